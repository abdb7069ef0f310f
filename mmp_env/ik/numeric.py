"""Numeric inverse kinematics of any chain: refines those configurations of a fixed table that are near the pose."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.chain import SerialChain
from mmp_env.ik.refinement import refined

_TABLE = 20000
"""Number of configurations in the table."""
_STARTS, _FEWEST_STARTS = 512, 24
"""Number of starts over all poses, and least number for a pose."""
_STEPS = 20


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

    def solve(self, poses: Float[np.ndarray, "m 4 4"]) -> tuple[Float[np.ndarray, "n dof"], Int[np.ndarray, "n"]]:
        """Returns configurations [rad or m], and the index of the pose of each."""
        count = max(_STARTS // len(poses), _FEWEST_STARTS)
        starts = np.concatenate([self._nearest(pose, count) for pose in poses])
        owners = np.repeat(np.arange(len(poses)), count)
        q, kept = refined(self._chain, self._table[starts], poses[owners], steps=_STEPS)
        return q, owners[kept]

    def _nearest(self, pose: Float[np.ndarray, "4 4"], count: int) -> Int[np.ndarray, "n"]:
        distance = ((self._positions - pose[:3, 3] / self._chain.length) ** 2).sum(axis=1) * 4.0
        cosine = (np.tensordot(self._rotations, pose[:3, :3], axes=2) - 1) / 2
        distance += np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2 / 4
        return np.argpartition(distance, count)[:count]


def even_points(count: int, dimension: int) -> Float[np.ndarray, "count dimension"]:
    """Returns points that fill the unit cube evenly: the additive recurrence of Roberts' generalized golden ratio."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1 + ratio) ** (1 / (dimension + 1))
    return (0.5 + np.outer(np.arange(count), ratio ** -np.arange(1.0, dimension + 1))) % 1.0
