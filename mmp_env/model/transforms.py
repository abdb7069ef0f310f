"""Rigid transforms as 4x4 matrices, quaternions as wxyz, fixed-axis roll-pitch-yaw as in URDF."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike


def matrix_from_quaternion(wxyz: ArrayLike) -> Float[np.ndarray, "3 3"]:
    """Returns the rotation matrix of a quaternion (wxyz) of any length above 0."""
    w, x, y, z = np.asarray(wxyz, dtype=float) / np.linalg.norm(wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_matrix(rotation: ArrayLike) -> Float[np.ndarray, "4"]:
    """Returns the quaternion (wxyz, w not negative) of a rotation matrix."""
    m = np.asarray(rotation, dtype=float)
    # Squares of w, x, y and z times 4; the largest is the one to divide by.
    squares = 1 + np.array([np.trace(m), *(2 * np.diag(m) - np.trace(m))])
    k = int(squares.argmax())
    skew = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    if k == 0:
        out = np.array([squares[0], *skew])
    else:
        both = m + m.T
        out = np.array([skew[k - 1], *both[k - 1]])
        out[k] = squares[k]
    out /= np.linalg.norm(out)
    return -out if out[0] < 0 else out


def quaternion_from_yaw(yaw: float) -> Float[np.ndarray, "4"]:
    """Returns the quaternion (wxyz) of a rotation by `yaw` [rad] about +z."""
    return np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])


def matrix_from_rpy(rpy: ArrayLike) -> Float[np.ndarray, "3 3"]:
    """Returns the rotation matrix Rz(yaw) Ry(pitch) Rx(roll) of angles [rad]."""
    r, p, y = np.asarray(rpy, dtype=float)
    cr, sr, cp, sp, cy, sy = np.cos(r), np.sin(r), np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def transform(rotation: ArrayLike, translation: ArrayLike) -> Float[np.ndarray, "4 4"]:
    """Returns the homogeneous transform of a rotation matrix and a translation [m]."""
    out = np.eye(4)
    out[:3, :3] = rotation
    out[:3, 3] = translation
    return out
