"""Finds the support of an object: a flat top within `SUPPORT_TOLERANCE_M` of its underside, below its centre."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.arm import Obstacle
from mmp_env.model.held import solid_hull
from mmp_env.model.transforms import matrix_from_quaternion

SUPPORT_TOLERANCE_M = 2e-3
"""Largest gap, and largest overlap, of an object and what it rests on [m]."""
SINK_M = 1e-3
"""Largest depth of a held object below where it rests, in the motions before a release and after a grasp [m]."""
FLAT_M = 1e-3
"""Largest difference in height of the corners of an underside or of a top [m]."""
BALANCE_M = 1e-3
"""Largest distance of an object's centre from the area that carries it, seen from above [m]."""


def supports(solid: Obstacle, others: Iterable[Obstacle]) -> tuple[list[str], str]:
    """Returns the names of the solids that an object rests on, and why it would not stay there; empty if it would."""
    found, points = [], []
    bottom = _lowest(solid)
    for other in others:
        area = _carried(bottom, other)
        if len(area):
            found.append(other.name)
            points.append(area)
    if not found:
        return [], f"nothing is within {SUPPORT_TOLERANCE_M * 1e3:g} mm of its underside, so it would fall"
    if not _inside(solid.position[:2], np.concatenate(points)):
        return [], f"its centre is not above {' and '.join(found)}, so it would fall"
    return found, ""


def overlap(solid: Obstacle, other: Obstacle) -> bool:
    """Returns whether an object is more than `SUPPORT_TOLERANCE_M` deep in another solid."""
    if float(np.linalg.norm(solid.position - other.position)) > _farthest(solid) + _farthest(other):
        return False
    vertices, radius = solid_hull(_shrunk(solid))
    still = np.tile(np.eye(3, 4).ravel(), (1, 2, 1))
    return any(
        np.isneginf(core.hull_distances(a=vertices, b=hull, poses=still, radius_a=radius, radius_b=grown)[0, 0])
        for hull, grown in _hulls(other)
    )


def distance(solid: Obstacle, point: Float[np.ndarray, "3"]) -> float:
    """Returns the distance of a point from a solid that is no mesh [m]; 0 inside."""
    local = matrix_from_quaternion(solid.quaternion).T @ (point - solid.position)
    if solid.size is not None:
        return float(np.linalg.norm(np.maximum(np.abs(local) - solid.size / 2, 0.0)))
    radius, half = solid.radius or 0.0, (solid.length or 0.0) / 2
    along, across = abs(float(local[2])), float(np.hypot(local[0], local[1]))
    if solid.shape == "cylinder":
        return float(np.hypot(max(along - half, 0.0), max(across - radius, 0.0)))
    return max(float(np.hypot(max(along - half, 0.0), across)) - radius, 0.0)


def width_across(solid: Obstacle, axis: Float[np.ndarray, "3"]) -> float:
    """Returns the least width of a solid that is no mesh, over all directions at right angles to an axis [m]."""
    vertices, radius = solid_hull(solid)
    across = np.linalg.svd(axis[None])[2][1:]  # two directions at right angles to the axis and to each other
    angles = np.linspace(0.0, np.pi, 180, endpoint=False)
    directions = np.cos(angles)[:, None] * across[0] + np.sin(angles)[:, None] * across[1]
    return float(np.ptp(vertices @ directions.T, axis=0).min()) + 2 * radius


def _farthest(solid: Obstacle) -> float:
    """Returns an upper bound of the distance of a point of a solid from its position [m]."""
    return max(float(np.linalg.norm(hull - solid.position, axis=1).max()) + radius for hull, radius in _hulls(solid))


def _shrunk(solid: Obstacle) -> Obstacle:
    """Returns a solid that is smaller by `SUPPORT_TOLERANCE_M` on all sides, as far as that leaves something."""
    size = None if solid.size is None else np.maximum(solid.size - 2 * SUPPORT_TOLERANCE_M, 1e-6)
    radius = None if solid.radius is None else max(solid.radius - SUPPORT_TOLERANCE_M, 1e-6)
    cap = 2 * SUPPORT_TOLERANCE_M if solid.shape == "cylinder" else 0.0
    length = None if solid.length is None else max(solid.length - cap, 1e-6)
    return replace(solid, size=size, radius=radius, length=length)


def _hulls(solid: Obstacle) -> list[tuple[Float[np.ndarray, "v 3"], float]]:
    if not solid.pieces:
        return [solid_hull(solid)]
    turn = matrix_from_quaternion(solid.quaternion)
    return [(piece @ turn.T + solid.position, 0.0) for piece in solid.pieces]


def _lowest(solid: Obstacle) -> Float[np.ndarray, "k 3"]:
    """Returns the corners of the underside of a solid [m]."""
    vertices, radius = solid_hull(solid)
    points = vertices - np.array([0.0, 0.0, radius])
    return points[points[:, 2] <= points[:, 2].min() + FLAT_M]


@functools.lru_cache(maxsize=4096)
def _tops(solid: Obstacle) -> list[tuple[float, Float[np.ndarray, "k 2"]]]:
    """Returns for each piece of a solid the height of its top [m], and the corners of that, seen from above [m]."""
    out = []
    for vertices, radius in _hulls(solid):
        heights = vertices[:, 2] + radius
        out.append((float(heights.max()), _ring(vertices[heights >= heights.max() - FLAT_M, :2])))
    return out


def _carried(bottom: Float[np.ndarray, "k 3"], other: Obstacle) -> Float[np.ndarray, "n 2"]:
    """Returns the corners of the area in which a solid carries an underside, seen from above [m]; maybe none."""
    out = [np.zeros((0, 2))]
    for height, area in _tops(other):
        near = abs(float(bottom[:, 2].min()) - height) <= SUPPORT_TOLERANCE_M
        if near and len(area) > 2 and _overlap(bottom[:, :2], area):  # nothing stays on an edge or a ball
            out.append(_clipped(_ring(bottom[:, :2]), area))
    return np.concatenate(out)


def _overlap(one: Float[np.ndarray, "k 2"], other: Float[np.ndarray, "m 2"]) -> bool:
    """Returns whether the boxes around two sets of points overlap."""
    apart = np.maximum(one.min(axis=0) - other.max(axis=0), other.min(axis=0) - one.max(axis=0))
    return bool(apart.max() <= 0)


def _ring(points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "m 2"]:
    """Returns the corners of the convex hull of points, against the clock."""
    rows = sorted({(round(x, 9), round(y, 9)) for x, y in points.tolist()})
    if len(rows) < 3:
        return np.array(rows)
    halves = []
    for order in (rows, rows[::-1]):
        half: list[tuple[float, float]] = []
        for p in order:
            while len(half) > 1 and _turn(half[-2], half[-1], p) <= 1e-12:
                half.pop()
            half.append(p)
        halves += half[:-1]
    return np.array(halves)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _clipped(ring: Float[np.ndarray, "k 2"], area: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "n 2"]:
    """Returns the corners of the part of a ring within a convex area (Sutherland and Hodgman)."""
    points = ring
    for a, b in zip(area, np.roll(area, -1, axis=0), strict=True):
        inward = np.array([a[1] - b[1], b[0] - a[0]])
        side, out = (points - a) @ inward, []
        for k in range(len(points)):
            j = k - 1
            if (side[j] < 0) != (side[k] < 0) and side[j] != side[k]:
                out.append(points[j] + (points[k] - points[j]) * side[j] / (side[j] - side[k]))
            if side[k] >= 0:
                out.append(points[k])
        points = np.array(out).reshape(-1, 2)
    return points


def _inside(point: Float[np.ndarray, "2"], points: Float[np.ndarray, "k 2"]) -> bool:
    """Returns whether a point is within `BALANCE_M` of the convex hull of points."""
    ring = _ring(points)
    if len(ring) > 2:
        ahead = np.roll(ring, -1, axis=0)
        along = ahead - ring
        inward = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
        return bool((np.sum((point - ring) * inward, axis=1) >= -BALANCE_M).all())
    along, off = ring[-1] - ring[0], point - ring[0]
    share = float(np.clip(off @ along / max(float(along @ along), 1e-18), 0.0, 1.0))
    return float(np.linalg.norm(off - share * along)) <= BALANCE_M
