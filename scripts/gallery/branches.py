"""A picture of all branches of one tool pose, side by side."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from mmp_env import Cell, place_arm
from mmp_env.files.writing import whole_file
from mmp_env.ik import branches_by_posture
from mmp_env.ik.chain import chain_of
from mmp_env.model.arm import Arm
from mmp_env.view.offscreen_renderer import OffscreenRenderer

SIZE, COLUMNS = (620, 520), 4
Q = (0.6, -1.5, 1.3, -0.9, 0.9, 0.4)
"""The configuration whose tool pose is shown [rad]."""
_CHANGED, _BORDER = 12, 10
"""Difference of a colour [of 255] that shows an arm; border around all of them [px]."""


def save_branches(path: Path) -> None:
    """Writes the picture of the branches of a UR5e."""
    with whole_file(path) as temporary:
        Image.fromarray(branches_picture("ur5e", Q)).save(temporary, "WEBP", quality=84, method=6)


def branches_picture(robot: str, q: tuple[float, ...], size: tuple[int, int] = SIZE) -> UInt8[np.ndarray, "h w 3"]:
    """Returns the picture of the branches that have the tool at the place that it has at `q`, one of each posture."""
    arm = place_arm("arm", robot, [0, 0, 0], [1, 0, 0, 0])
    with OffscreenRenderer(Cell(name="branches", arms=(arm,)), *size) as renderer:
        pictures = [renderer.picture({"arm": each}).astype(int) for each in one_of_each_posture(arm, q)]
    empty = np.median(pictures, axis=0)
    arms = np.array([np.abs(picture - empty).max(axis=2) > _CHANGED for picture in pictures])
    rows, columns = (np.flatnonzero(arms.any(axis=(0, axis + 1))) for axis in (1, 0))
    window = np.s_[max(rows[0] - _BORDER, 0) : rows[-1] + _BORDER, max(columns[0] - _BORDER, 0) : columns[-1] + _BORDER]
    shots = [picture[window] for picture in pictures]
    lines = [np.concatenate(shots[k : k + COLUMNS], axis=1) for k in range(0, len(shots), COLUMNS)]
    return np.concatenate(lines).astype(np.uint8)


def one_of_each_posture(arm: Arm, q: tuple[float, ...]) -> list[Float[np.ndarray, "dof"]]:
    """Returns the branch of each posture that is nearest to `q`, for the tool pose at `q`; the nearest one first."""
    near = np.array(q)
    rows, postures = branches_by_posture(arm.robot, arm.tool, tool_pose(arm, near), None, 1, near)
    assert len(np.unique(postures)) == len(rows)
    return list(rows)


def tool_pose(arm: Arm, q: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "4 4"]:
    """Returns the pose of the tool frame in the base frame."""
    frames = chain_of(arm.robot, arm.tool).frames(q[None])
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = frames.rotation[0], frames.position[0]
    return out
