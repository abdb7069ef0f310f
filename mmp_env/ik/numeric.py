"""Numeric inverse kinematics of any chain: refines those configurations of a fixed table that are near the pose."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.chain import SerialChain
from mmp_env.ik.freedom import Free
from mmp_env.ik.refinement import refined
from mmp_env.ik.tool_task import ToolTask

_TABLE, _STARTS = 20000, 512
"""Number of configurations in the table, and of those that are refined for a pose."""
_STEPS = 20
_PER_LENGTH = 4.0
"""Weight of a position error [arm lengths] relative to a rotation [rad]."""


class NumericSolver:
    """Finds configurations of a chain whose tool is at a pose. It finds most, not all, of them.

    Args:
        chain: the arm.
        lower: lower corner of the box of the table [rad or m].
        upper: upper corner of that box [rad or m].
    """

    def __init__(self, chain: SerialChain, lower: Float[np.ndarray, "dof"], upper: Float[np.ndarray, "dof"]) -> None:
        self._chain = chain
        self._table = lower + even_points(_TABLE, chain.dof) * (upper - lower)
        frames = chain.frames(self._table)
        self._positions, self._rotations = frames.position / chain.length, frames.rotation

    def solve(self, pose: Float[np.ndarray, "4 4"], free: Free | None) -> Float[np.ndarray, "n dof"]:
        """Returns configurations [rad or m]."""
        starts = self._table[self._nearest(pose, free)]
        poses = np.broadcast_to(pose, (len(starts), 4, 4))
        return refined(ToolTask(chain=self._chain, free=free), starts, poses, steps=_STEPS)[0]

    def _nearest(self, pose: Float[np.ndarray, "4 4"], free: Free | None) -> Int[np.ndarray, "n"]:
        distance = ((self._positions - pose[:3, 3] / self._chain.length) ** 2).sum(axis=1) * _PER_LENGTH**2
        if free != "rotation":
            axes = self._rotations[:, :, 2] @ pose[:3, 2]
            cosine = axes if free == "z" else (np.tensordot(self._rotations, pose[:3, :3], axes=2) - 1) / 2
            distance += np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2
        return np.argpartition(distance, _STARTS)[:_STARTS]


def even_points(count: int, dimension: int) -> Float[np.ndarray, "count dimension"]:
    """Returns points that fill the unit cube evenly: the additive recurrence of Roberts' generalized golden ratio."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1 + ratio) ** (1 / (dimension + 1))
    return (0.5 + np.outer(np.arange(count), ratio ** -np.arange(1.0, dimension + 1))) % 1.0
