"""Convex polytopes: hulls of points, and intersections of half-spaces."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env import core
from mmp_env.errors import MmpError
from mmp_env.meshes.mesh_files import require

_CHUNK = 200_000
"""Number of pairs of a point and a triangle that are compared at once, to bound the memory."""
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
        return core.plane_depths(points, self.planes)


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
    faces = _Faces(hull)
    step = max(1, _CHUNK // len(hull.triangles))
    parts = [faces.nearest(points[k : k + step]) for k in range(0, len(points), step)]
    return np.concatenate(parts) if parts else np.empty((0, 3))


class _Faces:
    """The triangles of a polytope and their edges, prepared for the nearest points of many points."""

    def __init__(self, hull: Polytope) -> None:
        corners = hull.vertices[hull.triangles]
        self._start, edges = corners, np.roll(corners, -1, axis=1) - corners
        normals = np.cross(edges[:, 0], edges[:, 1])
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        self._edges = edges
        self._squares = np.maximum(np.einsum("tki,tki->tk", edges, edges), 1e-30)
        self._inwards = np.cross(self._normals[:, None], edges)

    def nearest(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Returns the nearest point on any triangle: its own foot where that lies inside, else on an edge."""
        rows, best, out = np.arange(len(points)), np.full(len(points), np.inf), np.empty((len(points), 3))
        inside = np.ones((len(points), len(self._normals)), dtype=bool)
        for k in range(3):
            start, edge = self._start[:, k], self._edges[:, k]
            inside &= points @ self._inwards[:, k].T >= np.einsum("ti,ti->t", start, self._inwards[:, k])
            along = points @ edge.T - np.einsum("ti,ti->t", start, edge)
            share = np.clip(along / self._squares[:, k], 0, 1)
            away = points @ start.T * -2 + np.einsum("ti,ti->t", start, start)
            away += np.einsum("ni,ni->n", points, points)[:, None] + share * (share * self._squares[:, k] - 2 * along)
            face = away.argmin(axis=1)
            feet = start[face] + share[rows, face][:, None] * edge[face]
            self._improve(points, feet, best, out)
        height = points @ self._normals.T - np.einsum("ti,ti->t", self._start[:, 0], self._normals)
        face = np.where(inside, np.abs(height), np.inf).argmin(axis=1)
        feet = points - height[rows, face][:, None] * self._normals[face]
        self._improve(points, np.where(inside[rows, face][:, None], feet, np.inf), best, out)
        return out

    def _improve(self, points: np.ndarray, feet: np.ndarray, best: np.ndarray, out: np.ndarray) -> None:
        length = np.linalg.norm(points - feet, axis=1)
        better = length < best
        best[better], out[better] = length[better], feet[better]


def _hull(points: np.ndarray) -> Any:
    with _errors_of_qhull() as spatial:
        return spatial.ConvexHull(points)


@contextmanager
def _errors_of_qhull() -> Iterator[Any]:
    """Yields `scipy.spatial`, and raises `MmpError` for points in a plane, or `MemoryError`."""
    spatial = require("scipy.spatial")
    try:
        yield spatial
    except spatial.QhullError as error:
        if "insufficient memory" in str(error):
            raise MemoryError("Qhull got no memory") from None
        raise MmpError("the points of a convex piece lie in a plane; a collision mesh needs a volume") from None


def corner_points(planes: Float[np.ndarray, "p 4"], inside: Float[np.ndarray, "3"]) -> Float[np.ndarray, "v 3"]:
    """The vertices of an intersection of half-spaces around a point inside."""
    with _errors_of_qhull() as spatial:
        found = spatial.HalfspaceIntersection(np.column_stack([planes[:, :3], -planes[:, 3]]), inside).intersections
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
