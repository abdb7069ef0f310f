"""Chains of six hinges and targets, many at once; the core solves those with a special geometry in closed form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from mmp_env import core

_MISS = 0.05
"""Largest error of the wrist's position [arm lengths] of starts of a refinement."""


class Samples(NamedTuple):
    """Chains of six hinges in the notation of `SerialChain`. They may differ, for example by a locked joint."""

    axes: Float[np.ndarray, "m 6 3"]
    offsets: Float[np.ndarray, "m 7 3"]

    @property
    def points(self) -> Float[np.ndarray, "m 7 3"]:
        """Points on the axes, and the last frame, at zero positions [m]."""
        return np.cumsum(self.offsets, axis=1)

    def reversed(self) -> Samples:
        """Returns the chains from the last frame to the base; their poses are the inverse ones."""
        return Samples(-self.axes[:, ::-1], -self.offsets[:, ::-1])

    def solved(
        self, poses: Float[np.ndarray, "m 4 4"], spherical: bool
    ) -> tuple[Float[np.ndarray, "n 6"], Int[np.ndarray, "n"]]:
        """Returns joint angles [rad] near solutions, and the index of the chain of each.

        Args:
            poses: of the last frames, which are parallel to the base frame at zero positions.
            spherical: whether the last three axes meet; otherwise axes 2 to 4 are parallel, and axes 5 and 6 meet.
        """
        axes, offsets, poses = (np.ascontiguousarray(part) for part in (*self, poses))
        angles, rows = core.solve_six_hinges(axes, offsets, poses, spherical, _MISS)
        return angles, rows[:, 0]


def meeting_point(points: Float[np.ndarray, "m k 3"], axes: Float[np.ndarray, "m k 3"]) -> Float[np.ndarray, "m 3"]:
    """Returns the point [m] nearest to lines through points along unit vectors. The lines must not be all parallel."""
    across = np.eye(3) - axes[..., :, None] * axes[..., None, :]
    return np.linalg.solve(across.sum(axis=1), (across @ points[..., None]).sum(axis=1))[:, :, 0]
