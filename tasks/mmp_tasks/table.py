"""The table of a cell, and the free spots on it within the reach of an arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_tasks.draw_options import DrawFailed
from mmp_tasks.shared_space import neighbours

SPACING_M = 0.17
"""Least distance between two spots, so that two tools have room above them."""
_BASE_SPACING_M = 0.17
_CROWDED_RADIUS_M = 0.04
_SPOTS = 200
"""Number of random spots per call of `free_spot`."""


@dataclass(frozen=True, kw_only=True)
class Sector:
    """A sector of the table before an arm.

    Its radius is `nearest` to `farthest` times the reach of the arm. It extends by `aside` [rad] to either side of the
    direction in which the arm works.
    """

    nearest: float = 0.33
    farthest: float = 0.60
    aside: float = 1.0


class Table:
    """The horizontal plane through the lowest base, at `height` [m]; `bases` [a, 2] and their mean `center` [2] [m].

    If every arm reaches the mean of the bases, all arms work towards it. In a wider cell, each arm works towards the
    mean of its own base and those of its neighbours.
    """

    def __init__(self, cell: Cell) -> None:
        self.bases = np.array([arm.position[:2] for arm in cell.arms])
        self.center = self.bases.mean(axis=0)
        self.height = float(min(arm.position[2] for arm in cell.arms))
        self.far = next((arm for arm in cell.arms if not self._reaches_center(arm)), None)
        """The first arm that does not reach the mean of the bases, or None."""
        self._cell = cell
        boxes = {obstacle.name: _bounding_box(obstacle) for obstacle in cell.obstacles}
        self._standing = {name: box for name, box in boxes.items() if box[1, 2] > self.height + 1e-3}

    def meeting(self, arm: Arm) -> list[Arm]:
        """Returns the arms that work towards the same middle as `arm`, itself included."""
        return list(self._cell.arms) if self.far is None else [arm, *neighbours(self._cell, arm)]

    def middle(self, arm: Arm) -> Float[np.ndarray, " 2"]:
        """Returns the point [m] towards which an arm works."""
        return np.mean([other.position[:2] for other in self.meeting(arm)], axis=0)

    def crowded_radius(self, arm: Arm) -> float:
        """Returns the radius [m] about the middle of an arm in which the tools that meet have no room side by side."""
        count = len(self.meeting(arm))
        return _CROWDED_RADIUS_M * count if count > 1 else -np.inf

    def forward(self, arm: Arm) -> Float[np.ndarray, " 2"]:
        """Returns the direction in which an arm works: to its middle; an arm in the middle works forwards."""
        return self.towards(arm, self.middle(arm))

    def towards(self, arm: Arm, point: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 2"]:
        """Returns the direction from an arm to a point [m]; of an arm that stands there, the one it faces."""
        inward = point - arm.position[:2]
        distance = float(np.linalg.norm(inward))
        return inward / distance if distance > 0.05 else arm.T_world_base[:2, 0]

    def free_spot(
        self,
        arm: Arm,
        rng: np.random.Generator,
        taken: Sequence[Float[np.ndarray, " 2"]],
        height: float,
        sector: Sector,
    ) -> Float[np.ndarray, " 2"]:
        """Returns a random spot [m] in a sector before an arm for a thing of that `height` [m].

        The spot is `SPACING_M` from the spots `taken`, and clear of bases and of the obstacles on the table.

        Raises:
            DrawFailed: if there is none.
        """
        far, aside = rng.random(_SPOTS), rng.random(_SPOTS)
        reach = (sector.nearest + far * (sector.farthest - sector.nearest)) * arm.robot.reach
        angle = (2 * aside - 1) * sector.aside
        forward = self.forward(arm)
        across = np.array([-forward[1], forward[0]])
        directions = np.cos(angle)[:, None] * forward + np.sin(angle)[:, None] * across
        spots = arm.position[:2] + reach[:, None] * directions
        free = np.flatnonzero(self._free(spots, taken, height))
        if not len(free):
            raise DrawFailed.at(arm, ", which has no free spot on the table before it")
        return np.round(spots[free[0]], 4)

    def obstacle_at(self, point: Float[np.ndarray, " 2"], height: float) -> str | None:
        """Returns the name of an obstacle up to `height` [m] above the table at a point [m], or None."""
        for name, (low, high) in self._standing.items():
            if (low[:2] < point).all() and (point < high[:2]).all() and low[2] < self.height + height:
                return name
        return None

    def _reaches_center(self, arm: Arm) -> bool:
        return float(np.linalg.norm(self.center - arm.position[:2])) < arm.robot.reach

    def _free(
        self, spots: Float[np.ndarray, "n 2"], taken: Sequence[Float[np.ndarray, " 2"]], height: float
    ) -> Bool[np.ndarray, " n"]:
        """Returns which spots are clear of bases, of those `taken`, and of the obstacles up to `height` [m]."""
        free = _nearest(spots, self.bases) >= _BASE_SPACING_M
        if len(taken):
            free &= _nearest(spots, np.array(taken)) >= SPACING_M
        low = np.column_stack([spots - SPACING_M / 2, np.full(len(spots), self.height)])
        high = np.column_stack([spots + SPACING_M / 2, np.full(len(spots), self.height + height)])
        for box in self._standing.values():
            free &= ~((box[0] < high) & (low < box[1])).all(axis=1)
        return free


def _nearest(spots: Float[np.ndarray, "n 2"], others: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, " n"]:
    """Returns the distance [m] from each spot to the nearest of the others."""
    return np.linalg.norm(spots[:, None] - others, axis=2).min(axis=1)


def turned(direction: Float[np.ndarray, " 2"], angle: float) -> Float[np.ndarray, " 2"]:
    """Returns a direction in the plane, turned by `angle` [rad] to the left."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * direction[0] - s * direction[1], s * direction[0] + c * direction[1]])


def _bounding_box(obstacle: Obstacle) -> Float[np.ndarray, "2 3"]:
    """Returns the lowest and highest corner [m] of an upright box around an obstacle."""
    turn = matrix_from_quaternion(obstacle.quaternion)
    middle, reach = obstacle.position + turn @ obstacle.middle, np.abs(turn) @ obstacle.half_extents
    return np.array([middle - reach, middle + reach])
