"""Rotations that a tool pose leaves free, as a fixed dense sample of them."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from mmp_env.ik.chain import rotation_about

Free = Literal["z", "rotation"]
"""Rotation that a tool pose leaves free: about the z axis of the tool, or any."""
FREE: tuple[str, ...] = get_args(Free)


def sampled_poses(pose: Float[np.ndarray, "4 4"], free: Free | None, count: int) -> Float[np.ndarray, "m 4 4"]:
    """Returns poses that stand for a pose, some of whose rotation is free: `count` of them, the pose itself first."""
    if free is None:
        return pose[None]
    if free == "z":
        rotations = rotation_about(np.array([0.0, 0.0, 1.0]), 2 * np.pi * np.arange(count) / count)
    else:
        rotations = even_rotations(count)
    out = np.tile(pose, (len(rotations), 1, 1))
    out[:, :3, :3] = pose[:3, :3] @ rotations
    return out


def even_rotations(count: int) -> Float[np.ndarray, "count 3 3"]:
    """Returns rotation matrices that fill all rotations evenly, the identity first.

    These are super-Fibonacci spirals (Alexa: Super-Fibonacci Spirals, CVPR 2022), turned so that one is the identity.
    """
    k = np.arange(count) + 0.5
    inner, outer = np.sqrt(k / count), np.sqrt(1 - k / count)
    first, second = 2 * np.pi * k / np.sqrt(2.0), 2 * np.pi * k / 1.533751168755204288118041
    x, y, z, w = inner * np.sin(first), inner * np.cos(first), outer * np.sin(second), outer * np.cos(second)
    rotations = np.empty((count, 3, 3))
    rotations[:, 0] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1)
    rotations[:, 1] = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1)
    rotations[:, 2] = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    return rotations @ rotations[0].T
