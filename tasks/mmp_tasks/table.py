"""The table of a cell: where on it things can stand, within the reach of an arm and clear of what is there already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_tasks.drawing import DrawFailed

_BASE_ROOM_M = 0.17
_CROWD_M = 0.04
_TRIES = 200


@dataclass(frozen=True, kw_only=True)
class Sector:
    """Things stand `nearest` to `farthest` reaches from the base of the arm that handles them.

    They are at most `aside` [rad] to either side of the direction in which it works.
    """

    nearest: float = 0.33
    farthest: float = 0.60
    aside: float = 1.0


class Table:
    """The plane of the lowest base, which is taken to be the top of a table."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self.bases = np.array([arm.position[:2] for arm in cell.arms])
        self.center = self.bases.mean(axis=0)
        self.height = float(min(arm.position[2] for arm in cell.arms))
        self.crowd = _CROWD_M * len(cell.arms) if len(cell.arms) > 1 else -np.inf
        """In so wide a circle about the middle [m] the tools of all arms have no room side by side."""
        self._standing = [box for box in map(_around, cell.obstacles) if box[1, 2] > self.height + 1e-3]

    def forward(self, arm: Arm) -> Float[np.ndarray, " 2"]:
        """The direction in which an arm works: to the middle of the cell, or the way it faces where it stands there."""
        inward = self.center - arm.position[:2]
        distance = float(np.linalg.norm(inward))
        return inward / distance if distance > 0.05 else arm.T_world_base[:2, 0]

    def spot(
        self,
        arm: Arm,
        rng: np.random.Generator,
        taken: Sequence[Float[np.ndarray, " 2"]],
        room: float,
        height: float,
        sector: Sector,
    ) -> Float[np.ndarray, " 2"]:
        """A random place in a sector before an arm, `room` [m] from those `taken`, for what is up to `height` [m] high.

        Raises `DrawFailed` where there is none.
        """
        far, aside = rng.random(_TRIES), rng.random(_TRIES)
        reach = (sector.nearest + far * (sector.farthest - sector.nearest)) * arm.robot.reach
        angle = (2 * aside - 1) * sector.aside
        forward = self.forward(arm)
        across = np.array([-forward[1], forward[0]])
        ways = np.cos(angle)[:, None] * forward + np.sin(angle)[:, None] * across
        spots = arm.position[:2] + reach[:, None] * ways
        free = np.flatnonzero(self._free(spots, taken, room, height))
        if not len(free):
            raise DrawFailed.at(arm, ", which has no free place on the table before it")
        return np.round(spots[free[0]], 4)

    def _free(
        self, spots: Float[np.ndarray, "n 2"], taken: Sequence[Float[np.ndarray, " 2"]], room: float, height: float
    ) -> Bool[np.ndarray, " n"]:
        """Which places are clear of bases, of those `taken`, and of the cell's own obstacles up to `height` [m]."""
        free = _nearest(spots, self.bases) >= _BASE_ROOM_M
        if len(taken):
            free &= _nearest(spots, np.array(taken)) >= room
        low = np.column_stack([spots - room / 2, np.full(len(spots), self.height)])
        high = np.column_stack([spots + room / 2, np.full(len(spots), self.height + height)])
        for box in self._standing:
            free &= ~((box[0] < high) & (low < box[1])).all(axis=1)
        return free


def _nearest(spots: Float[np.ndarray, "n 2"], others: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, " n"]:
    """How far [m] the nearest of the others is from each spot."""
    return np.linalg.norm(spots[:, None] - others, axis=2).min(axis=1)


def turned(direction: Float[np.ndarray, " 2"], angle: float) -> Float[np.ndarray, " 2"]:
    """A direction in the plane, turned by `angle` [rad] to the left."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * direction[0] - s * direction[1], s * direction[0] + c * direction[1]])


def _around(obstacle: Obstacle) -> Float[np.ndarray, "2 3"]:
    """Lowest and highest corner of an upright box around an obstacle."""
    reach = np.abs(matrix_from_quaternion(obstacle.quaternion)) @ obstacle.half_extents
    return np.array([obstacle.position - reach, obstacle.position + reach])
