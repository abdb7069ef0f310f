"""Errors of tool frames from their target poses, and how the joints change them, for many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.ik.chain import Frames, SerialChain
from mmp_env.ik.freedom import Free
from mmp_env.ik.subproblems import cross, dot

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

    def error(self, frames: Frames, poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n rows"]:
        """Returns the position error [arm lengths], then the rotation [rad] to the pose in the tool frame."""
        position = (poses[:, :3, 3] - frames.position) / self.chain.length
        if self.free == "rotation":
            return position
        back = frames.rotation.transpose(0, 2, 1)
        if self.free == "z":
            z = (back @ poses[:, :3, 2, None])[:, :, 0]
            return np.concatenate([position, _scaled(np.stack([-z[:, 1], z[:, 0]], axis=1), z[:, 2])], axis=1)
        return np.concatenate([position, rotation_vector(back @ poses[:, :3, :3])], axis=1)

    def slope(self, frames: Frames) -> Float[np.ndarray, "n rows dof"]:
        """Returns the motion of the tool in the units of `error` by a motion of each joint."""
        slides = self.chain.slides[:, None]
        turning = cross(frames.axes, frames.position[:, None] - frames.points)
        out = np.empty((len(frames.position), self.rows, self.chain.dof))
        out[:, :3] = np.where(slides, frames.axes, turning).transpose(0, 2, 1) / self.chain.length
        if self.rows > 3:
            turns = np.where(slides, 0.0, frames.axes) @ frames.rotation
            out[:, 3:] = turns[:, :, : self.rows - 3].transpose(0, 2, 1)
        return out


def rotation_vector(rotation: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3"]:
    """Returns the axis times the angle [rad] of rotation matrices; of a half turn, the zero vector."""
    double = np.stack([rotation[:, j, i] - rotation[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    return _scaled(double / 2, (np.trace(rotation, axis1=1, axis2=2) - 1) / 2)


def _scaled(vector: Float[np.ndarray, "n k"], cosine: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n k"]:
    """Returns vectors, whose length is the sine of an angle, with the angle as their length."""
    sine = np.sqrt(dot(vector, vector))
    return vector * np.where(sine > 1e-12, np.arctan2(sine, cosine) / np.maximum(sine, 1e-12), 1.0)[:, None]
