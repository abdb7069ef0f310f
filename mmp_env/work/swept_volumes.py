"""Motions as the volumes that arms sweep: which parts of two motions conflict, whenever the arms do them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from mmp_env import core
from mmp_env.ik.chain import chain_of
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.work.trajectory import spline

PARTS = 2
"""Number of straight lines that stand for the curve in each period."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SweptMotion:
    """A motion of one arm, from rest to rest.

    Attributes:
        arm: number of the arm.
        samples: of its curve [k, dof] [rad, of slides m], one per period.
        motion: straight lines between points of the curve, `PARTS` lines per period.
        stray_m: distance of the bodies on the curve from those on the lines [m], an upper bound.
    """

    arm: int
    samples: Float[np.ndarray, "k dof"]
    motion: core.Motion
    stray_m: float

    @property
    def last(self) -> int:
        """Number of the last period, whose end is the rest after the motion."""
        return max(len(self.samples) - 2, 0)


class SweptVolumes:
    """Makes swept motions of the arms of a cell, and compares them.

    Args:
        cell: the cell.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._holding: dict[tuple[int, Obstacle | None], tuple[Cell, float]] = {}

    def of(self, arm: int, samples: Float[np.ndarray, "k dof"], held: Obstacle | None = None) -> SweptMotion:
        """Returns the motion of an arm through samples, with what it holds; one sample is an arm at rest."""
        cell, reach = self._with(arm, held)
        rows = samples if len(samples) > 1 else np.repeat(samples, 2, axis=0)
        # A curve is at most an eighth of its largest second derivative from its chord.
        bend = np.abs(np.diff(np.pad(rows, ((1, 1), (0, 0)), mode="edge"), n=2, axis=0)) / (8 * PARTS**2)
        points = spline(rows, np.arange(PARTS * (len(rows) - 1) + 1) / PARTS)
        return SweptMotion(
            arm=arm,
            samples=rows,
            motion=cell.collision.motion(cell.arm_names[arm], points),
            stray_m=reach * float(bend.sum(axis=1).max()),
        )

    def conflicts(self, a: SweptMotion, b: SweptMotion, distance: float) -> Bool[np.ndarray, "s t"]:
        """Returns which parts of periods [of a, of b] may come closer than a distance [m], at any two times."""
        if a.arm > b.arm:  # so that both orders of arguments have the same result
            return self.conflicts(b, a, distance).T
        wanted = distance + a.stray_m + b.stray_m
        return core.swept_conflicts(a.motion, b.motion, wanted)

    def last_conflicts(self, a: SweptMotion, b: SweptMotion, distance: float) -> tuple[int, int]:
        """Returns the last period of each motion that may come too close to any of the other; -1 if none does."""
        found = self.conflicts(a, b, distance)
        first, second = np.nonzero(found)
        return (int(first.max()) // PARTS, int(second.max()) // PARTS) if len(first) else (-1, -1)

    def _with(self, arm: int, held: Obstacle | None) -> tuple[Cell, float]:
        """Returns the arms, one of which holds something, and the reach of that arm [m]."""
        if (arm, held) not in self._holding:
            cell = self._cell
            if held is not None:
                arms = [replace(each, held=held) if k == arm else each for k, each in enumerate(cell.arms)]
                cell = replace(cell, arms=tuple(arms), obstacles=())
            self._holding[arm, held] = cell, _reach(cell, cell.arms[arm])
        return self._holding[arm, held]


def _reach(cell: Cell, arm: Arm) -> float:
    """Returns an upper bound of how far a point of an arm moves per unit of a joint [m]."""
    chain, collision = chain_of(arm.robot, arm.tool), cell.collision
    base = arm.T_world_base
    points = chain.frames(arm.robot.home[None]).points[0] @ base[:3, :3].T + base[:3, 3]
    centers, radii = collision.spheres(arm.name, arm.robot.home[None])
    moving = ~collision.is_base(arm.name)
    to_joints = np.linalg.norm(centers[0, moving, None] - points, axis=2)
    travel = np.maximum(np.abs(arm.robot.lower), np.abs(arm.robot.upper))[chain.slides].sum()
    # A body is carried by one of the joints, so it is as far from the farthest of them as at home, at most.
    size = float((to_joints.max(axis=1) + radii[moving]).max())
    return max(chain.length + float(travel) + size, 1.0)
