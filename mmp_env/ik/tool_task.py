"""The task to bring a tool frame to a pose: which of its rotation counts, and how the joints move the tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.ik.chain import Frames, SerialChain
from mmp_env.ik.freedom import Free

_ROWS: dict[Free | None, int] = {None: 6, "z": 5, "rotation": 3}


@dataclass(frozen=True, kw_only=True, eq=False)
class ToolTask:
    """The task to bring the tool frame of a chain to a pose, some of whose rotation may be free.

    Attributes:
        chain: the arm.
        free: rotation that may be any.
    """

    chain: SerialChain
    free: Free | None

    @property
    def rows(self) -> int:
        """Number of equations."""
        return _ROWS[self.free]

    def slope(self, frames: Frames) -> Float[np.ndarray, "n rows dof"]:
        """Returns the motion of the tool [arm lengths, then rad in its own frame] by a motion of each joint."""
        slides = self.chain.slides[:, None]
        turning = np.cross(frames.axes, frames.position[:, None] - frames.points)
        out = np.empty((len(frames.position), self.rows, self.chain.dof))
        out[:, :3] = np.where(slides, frames.axes, turning).transpose(0, 2, 1) / self.chain.length
        if self.rows > 3:
            turns = np.where(slides, 0.0, frames.axes) @ frames.rotation
            out[:, 3:] = turns[:, :, : self.rows - 3].transpose(0, 2, 1)
        return out


def rotation_vector(rotation: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3"]:
    """Returns the axis times the angle [rad] of rotation matrices; of a half turn, the zero vector."""
    double = np.stack([rotation[:, j, i] - rotation[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    sine, cosine = np.linalg.norm(double / 2, axis=1), (np.trace(rotation, axis1=1, axis2=2) - 1) / 2
    return double / 2 * np.where(sine > 1e-12, np.arctan2(sine, cosine) / np.maximum(sine, 1e-12), 1.0)[:, None]
