"""The checker's distances: points to convex solids, moving points to each other, support functions of MuJoCo geoms.

Signed distances are positive outside and negative inside. Every function is vectorised over leading axes.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.mujoco_import import mujoco

Array = np.ndarray
GEOM_KINDS = SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = tuple(
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}")) for name in ("SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX")
)
"""MuJoCo's numbers of the shapes that `geom_support` knows."""
_TINY_M = 1e-290
"""Length [m] up to which a direction is not computed: below, quotients lose their accuracy."""
MESH = int(mujoco.mjtGeom.mjGEOM_MESH)


def solid_distance(
    shape: str, size: Float[Array, "3"], points: Float[Array, "*n 3"]
) -> tuple[Float[Array, "*n"], Float[Array, "*n 3"]]:
    """Returns the signed distance [m] of `points` to a solid about the origin, and a subgradient of it.

    `size` [m]: half edges of a `box`; radius and half length without caps of the others. Signed distance to a convex
    set is convex, so d(y) >= d(x) + g(x) . (y - x) for all y.
    """
    if shape == "box":
        return _box(size, points)
    if shape == "cylinder":
        radial = np.hypot(points[..., 0], points[..., 1])
        flat = np.stack([radial, points[..., 2]], axis=-1)
        distance, slope = _box(size[:2], flat)
        # On the axis every radial direction is as good as another.
        outward = np.divide(
            points[..., :2], radial[..., None], out=_unit_x(points)[..., :2], where=radial[..., None] > 0
        )
        return distance, np.concatenate([slope[..., :1] * outward, slope[..., 1:]], axis=-1)
    core = np.zeros_like(points)
    if shape == "capsule":
        core[..., 2] = np.clip(points[..., 2], -size[1], size[1])
    away = points - core
    length = np.hypot.reduce(away, axis=-1)  # squares of tiny lengths would vanish
    gradient = np.divide(away, length[..., None], out=np.zeros_like(away), where=length[..., None] > _TINY_M)
    return length - size[0], gradient


def _unit_x(points: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    out = np.zeros_like(points)
    out[..., 0] = 1.0
    return out


def _box(half: Float[Array, "d"], points: Float[Array, "*n d"]) -> tuple[Float[Array, "*n"], Float[Array, "*n d"]]:
    """Returns the signed distance to a box of any dimension with `half` edges, and a subgradient."""
    beyond = np.abs(points) - half
    sign = np.where(points < 0, -1.0, 1.0)
    outside = np.maximum(beyond, 0.0)
    length = np.hypot.reduce(outside, axis=-1)
    nearest_face = np.eye(half.size)[np.argmax(beyond, axis=-1)]
    gradient = sign * np.divide(outside, length[..., None], out=nearest_face, where=length[..., None] > _TINY_M)
    return np.where(length > 0, length, beyond.max(axis=-1)), gradient


def tangent_minimum(
    start: Float[Array, "*n"], slope: Float[Array, "*n"], end: Float[Array, "*n"], slope_back: Float[Array, "*n"]
) -> Float[Array, "*n"]:
    """Returns the least over s in [0, 1] of the larger of two lines, start + s slope and end + (1 - s) slope_back.

    The least value is at an end or where the lines cross. Tangents at both ends bound a convex function from below.
    """
    total = slope + slope_back
    s = np.divide(end + slope_back - start, total, out=np.zeros_like(start), where=total != 0)
    s = np.clip(s, 0.0, 1.0)
    least = np.maximum(start + s * slope, end + (1 - s) * slope_back)
    least = np.minimum(least, np.maximum(start, end + slope_back))
    return np.minimum(least, np.maximum(start + slope, end))


def chord_minimum(square: Float[Array, "*n"], dot: Float[Array, "*n"], step: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Returns the least length over s in [0, 1] of d + s e, from d.d, d.e and e.e: two points on straight lines."""
    s = np.clip(np.divide(-dot, step, out=np.zeros_like(dot), where=step > 0), 0.0, 1.0)
    return np.sqrt(np.maximum(square + s * (2.0 * dot + s * step), 0.0))


def geom_support(
    kind: Float[Array, "n"] | Array, size: Float[Array, "n 3"], direction: Float[Array, "n 3"]
) -> Float[Array, "n"]:
    """Returns the largest n . x [m] over the points x of MuJoCo geoms about the origin, for unit directions n.

    All these shapes are symmetric about their centre, so the support of -n is the same.
    """
    x, y, z = np.abs(direction).T
    supports = (
        size[:, 0],
        size[:, 0] + size[:, 1] * z,
        np.linalg.norm(size * direction, axis=1),
        size[:, 0] * np.hypot(x, y) + size[:, 1] * z,
        size[:, 0] * x + size[:, 1] * y + size[:, 2] * z,
    )
    return np.select([kind == known for known in GEOM_KINDS], supports, default=np.inf)
