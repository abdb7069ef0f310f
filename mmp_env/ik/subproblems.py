"""Geometric subproblems of inverse kinematics, for many samples at once.

Canonical subproblems after Paden and Kahan, in the form of Elias and Wen: IK-Geo: Unified Robot Inverse Kinematics
Using Subproblem Decomposition (arXiv 2211.05737). Where an equation has no solution, the angle is that of the least
error: the results are starts of a refinement. Arrays of vectors are [..., 3] and broadcast.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def dot(a: Float[np.ndarray, "*_"], b: Float[np.ndarray, "*_"]) -> Float[np.ndarray, "*_"]:
    """Returns the scalar products of vectors."""
    return (a * b).sum(axis=-1)


def cross(a: Float[np.ndarray, "*_"], b: Float[np.ndarray, "*_"]) -> Float[np.ndarray, "*_"]:
    """Returns the cross products of vectors; faster than `numpy.cross`."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def rotated(
    axis: Float[np.ndarray, "*_"], angle: Float[np.ndarray, "*_"], vector: Float[np.ndarray, "*_"]
) -> Float[np.ndarray, "*_"]:
    """Returns vectors rotated about unit vectors by angles [rad]."""
    sine, cosine = np.sin(angle)[..., None], np.cos(angle)[..., None]
    along = dot(axis, vector)[..., None] * axis
    return along + cosine * (vector - along) + sine * cross(axis, vector)


def angle_between(
    axis: Float[np.ndarray, "*_"], start: Float[np.ndarray, "*_"], end: Float[np.ndarray, "*_"]
) -> Float[np.ndarray, "*_"]:
    """Returns the angles [rad] about an axis that bring `start` nearest to `end` (subproblem 1)."""
    sine = dot(axis, cross(start, end))
    cosine = dot(start, end) - dot(axis, start) * dot(axis, end)
    return np.arctan2(sine, cosine)


def angles_of_height(
    axis: Float[np.ndarray, "*_"],
    vector: Float[np.ndarray, "*_"],
    direction: Float[np.ndarray, "*_"],
    height: Float[np.ndarray, "*_"],
) -> Float[np.ndarray, "*_ 2"]:
    """Returns both angles [rad] about an axis at which direction . rotated vector = height (subproblem 4)."""
    along = dot(axis, vector) * dot(axis, direction)
    cosine, sine = dot(direction, vector) - along, dot(direction, cross(axis, vector))
    size = np.maximum(np.hypot(cosine, sine), 1e-300)
    middle, half = np.arctan2(sine, cosine), np.arccos(np.clip((height - along) / size, -1.0, 1.0))
    return np.stack([middle - half, middle + half], axis=-1)


def perpendicular(axis: Float[np.ndarray, "*_"]) -> Float[np.ndarray, "*_"]:
    """Returns a unit vector perpendicular to each unit vector."""
    other = np.zeros_like(axis)
    np.put_along_axis(other, np.abs(axis).argmin(axis=-1)[..., None], 1.0, axis=-1)
    out = cross(axis, other)
    return out / np.linalg.norm(out, axis=-1, keepdims=True)
