"""Convex polytopes: hulls of points, and intersections of half-spaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError
from mmp_env.meshes.mesh_files import require

ROUNDING_M = 1e-6
"""Grid [m] of the numbers in files. Twice as much is added to radii and planes, so that rounding loses nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Polytope:
    """A convex polytope: `vertices` [v, 3] [m], outward `triangles` [t, 3] of them, `planes` [p, 4] (n, n.x <= d)."""

    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "t 3"]
    planes: Float[np.ndarray, "p 4"]
    volume: float

    def depth(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Returns how deep [m] points lie inside; negative outside, where it bounds the distance from below."""
        return (self.planes[:, 3] - points @ self.planes[:, :3].T).min(axis=1)


def polytope(points: Float[np.ndarray, "n 3"]) -> Polytope:
    """Returns the convex hull of points. Raises `MmpError` where they lie in a plane."""
    hull = _hull(points)
    center = points[hull.vertices].mean(axis=0)
    number = np.full(len(points), -1)
    number[hull.vertices] = np.arange(len(hull.vertices))
    corners = points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flip = np.einsum("ij,ij->i", normals, corners[:, 0] - center) < 0
    triangles = number[hull.simplices]
    triangles[flip] = triangles[flip][:, ::-1]
    planes = np.column_stack([hull.equations[:, :3], -hull.equations[:, 3]])
    return Polytope(
        vertices=points[hull.vertices], triangles=triangles, planes=_distinct(planes), volume=float(hull.volume)
    )


def distances(points: Float[np.ndarray, "n 3"], hull: Polytope) -> Float[np.ndarray, "n"]:
    """Returns the distances [m] of points outside a polytope from its surface."""
    return np.linalg.norm(points - nearest_points(points, hull), axis=1)


def nearest_points(points: Float[np.ndarray, "n 3"], hull: Polytope) -> Float[np.ndarray, "n 3"]:
    """Returns the points of a polytope's surface that are nearest to points outside."""
    a, b, c = (hull.vertices[hull.triangles[:, k]] for k in range(3))
    return np.array([_nearest_on_triangles(point, a, b, c) for point in points]).reshape(-1, 3)


def _nearest_on_triangles(p: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Returns the point of triangles [t, 3] each that is nearest to one point."""
    normal = np.cross(b - a, c - a)
    size = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-30)
    inside = np.ones(len(a), dtype=bool)
    feet = []
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        inside &= np.einsum("ij,ij->i", np.cross(edge, p - start), normal) >= 0
        share = np.einsum("ij,ij->i", p - start, edge) / np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-30)
        feet.append(start + np.clip(share, 0, 1)[:, None] * edge)
    flat = p - (np.einsum("ij,ij->i", p - a, normal) / size)[:, None] * normal
    feet = np.concatenate([*feet, flat[inside]])
    return feet[np.linalg.norm(feet - p, axis=1).argmin()]


def _hull(points: np.ndarray) -> Any:
    spatial = require("scipy.spatial")
    try:
        return spatial.ConvexHull(points)
    except spatial.QhullError:
        raise MmpError("the points of a convex piece lie in a plane; a collision mesh needs a volume") from None


def corner_points(planes: Float[np.ndarray, "p 4"], inside: Float[np.ndarray, "3"]) -> Float[np.ndarray, "v 3"]:
    """The vertices of an intersection of half-spaces around a point inside."""
    spatial = require("scipy.spatial")
    try:
        found = spatial.HalfspaceIntersection(np.column_stack([planes[:, :3], -planes[:, 3]]), inside).intersections
    except spatial.QhullError:
        raise MmpError("the points of a convex piece lie in a plane; a collision mesh needs a volume") from None
    found = found[np.isfinite(found).all(axis=1)]
    _, first = np.unique(np.round(found, 7), axis=0, return_index=True)
    return found[np.sort(first)]


def _distinct(planes: Float[np.ndarray, "p 4"]) -> Float[np.ndarray, "d 4"]:
    """Planes without those that are the same to nine digits."""
    _, first = np.unique(np.round(planes, 9), axis=0, return_index=True)
    return planes[np.sort(first)]


def rounded(points: np.ndarray) -> np.ndarray:
    return np.unique(np.round(np.round(points / ROUNDING_M) * ROUNDING_M, 6), axis=0) + 0.0


def spread_directions(count: int) -> Float[np.ndarray, "n 3"]:
    """Evenly spread unit vectors (a Fibonacci lattice) and those along the axes."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle, ring = np.pi * (1 + 5**0.5) * np.arange(count), np.sqrt(1 - z**2)
    spread = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return np.concatenate([spread, np.eye(3), -np.eye(3)])
