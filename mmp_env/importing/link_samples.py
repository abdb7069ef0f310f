"""Points from which a sphere cover is fitted: samples of a link's surface and inside, and centres of candidates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mmp_env.importing.link_shape import LinkShape

_SURFACE, _EDGES, _INNER = 2600, 1600, 400
_USUAL_M2, _MOST_TIMES = 0.2, 8.0
"""Surface from which on the number of samples grows with it, and the largest factor."""
_INSIDE_M = 0.01
"""Distance [m] from the spheres up to which points inside a link count as covered."""
_MOST_CUBES = 2.0**62
"""Number of cubes of a grid up to which one whole number counts them."""
_SHARP_RAD = 0.12
"""Angle [rad] between neighbouring triangles from which on their edge has samples of its own."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Edges:
    """Sharp edges: ends `a`, `b` [e, 3] [m], mean outward `normal` [e, 3], half the angle between faces `half` [e]."""

    a: Float[np.ndarray, "e 3"]
    b: Float[np.ndarray, "e 3"]
    normal: Float[np.ndarray, "e 3"]
    half: Float[np.ndarray, "e"]
    owner: Int[np.ndarray, "e"]


class CoverSamples:
    """`points` [n, 3] with their thickness `thick` [n] [m] to be covered, and `centers` [c, 3] that may cover them.

    `detail` scales the numbers of all of them, which are larger for large links.
    """

    def __init__(self, shape: LinkShape, allowed: float, random: np.random.Generator, detail: float) -> None:
        detail *= float(np.clip(shape.areas.sum() / _USUAL_M2, 1.0, _MOST_TIMES))
        self._shape, self._allowed, self._random, self._detail = shape, allowed, random, detail
        chosen = random.choice(len(shape.areas), 3 * int(detail * _SURFACE), p=shape.areas / shape.areas.sum())
        surface = np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), len(chosen)), shape.triangles[chosen])
        keep = _spread(surface, int(detail * _SURFACE))
        surface, chosen = surface[keep], chosen[keep]
        edges = sharp_edges(shape)
        along, edge = self._along(edges)
        inner = self._inner(int(detail * _INNER))
        points = np.concatenate([surface, along])
        owner = np.concatenate([shape.owner[chosen], edges.owner[edge]]).astype(int)
        thick = shape.thickness_of[owner]
        visible = ~shape.inside_another(np.repeat(points[:, None], 3, axis=1), owner)
        self.points = np.concatenate([points[visible], inner])
        self.thick = np.concatenate([thick[visible], np.full(len(inner), -_INSIDE_M)])
        self.centers = np.concatenate(
            [
                self._below(surface, shape.normals[chosen]),
                self._below_edges(edges, along, edge),
                self._inner(int(detail * 900)),
            ]
        )

    def _along(self, edges: Edges) -> tuple[np.ndarray, np.ndarray]:
        """Points along edges and the numbers of their edges."""
        length = np.linalg.norm(edges.b - edges.a, axis=1)
        spacing = max(self._allowed / 5, length.sum() / (self._detail * _EDGES))
        count = np.maximum(1, np.ceil(length / spacing)).astype(int)
        edge = np.repeat(np.arange(len(length)), count)
        step = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
        share = ((step + 0.5) / count[edge])[:, None]
        if not len(edge):
            return np.empty((0, 3)), edge
        inner = edges.a[edge] * (1 - share) + edges.b[edge] * share
        return np.concatenate([inner, edges.a]), np.concatenate([edge, np.arange(len(length))])

    def _below(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Returns centres below the surface, near the depth at which another face becomes the nearest, and above it."""
        some = self._random.permutation(len(points))[: int(self._detail * 1100)]
        points, normals = points[some], normals[some]
        low, high = np.zeros(len(points)), np.full(len(points), self._shape.size)
        for _ in range(12):  # the largest depth at which the point's own face is still the nearest
            middle = (low + high) / 2
            own = self._shape.depth(points - normals * middle[:, None]) >= 0.98 * middle
            low, high = np.where(own, middle, low), np.where(own, high, middle)
        shares = self._random.uniform(0.2, 1.0, len(low))
        return np.concatenate([points - normals * (s * low)[:, None] for s in (0.99, 0.8, shares)])

    def _below_edges(self, edges: Edges, along: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Centres below edges: a ball that protrudes by p covers most of an edge from a depth of p / tan^2(half)."""
        if not len(edge):
            return np.empty((0, 3))
        some = self._random.permutation(len(edge))[: int(self._detail * 900)]
        half = np.clip(edges.half[edge[some]], 0.05, 1.5)
        best = self._allowed / np.tan(half) ** 2 / np.cos(half)
        best = np.minimum(best, self._shape.size / 2)
        return np.concatenate([along[some] - edges.normal[edge[some]] * (best * s)[:, None] for s in (0.75, 1.0, 1.2)])

    def _inner(self, count: int) -> np.ndarray:
        """Random points inside, evenly in each piece."""
        shape, out = self._shape, []
        for k in range(len(shape.pieces)):
            own, middle = shape.owner == k, shape.middle(k)
            triangles = shape.triangles[own]
            cones = shape.areas[own] * np.abs(np.einsum("ij,ij->i", triangles[:, 0] - middle, shape.normals[own]))
            number = max(20, count // len(shape.pieces))
            chosen = self._random.choice(len(triangles), number, p=cones / cones.sum())
            surface = np.einsum("nk,nkd->nd", self._random.dirichlet(np.ones(3), number), triangles[chosen])
            out.append(middle + np.cbrt(self._random.random(number))[:, None] * (surface - middle))
        return np.concatenate(out)


def sharp_edges(shape: LinkShape) -> Edges:
    """Returns the edges of all pieces at which the surface turns by more than a few degrees."""
    triangles = shape.triangles
    _, corner = np.unique(np.round(triangles.reshape(-1, 3), 8), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    ends = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    face = np.tile(np.arange(len(triangles)), 3)
    start = np.concatenate([triangles[:, 0], triangles[:, 1], triangles[:, 2]])
    stop = np.concatenate([triangles[:, 1], triangles[:, 2], triangles[:, 0]])
    order = np.lexsort((ends[:, 1], ends[:, 0], shape.owner[face]))
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1) & (
        shape.owner[face[order[1:]]] == shape.owner[face[order[:-1]]]
    )
    first, second = order[:-1][same], order[1:][same]
    normal = shape.normals[face[first]] + shape.normals[face[second]]
    length = np.linalg.norm(normal, axis=1)
    half = np.arccos(np.clip(length / 2, 0, 1))
    sharp = (2 * half > _SHARP_RAD) & (length > 1e-6)
    return Edges(
        a=start[first][sharp],
        b=stop[first][sharp],
        normal=normal[sharp] / length[sharp][:, None],
        half=half[sharp],
        owner=shape.owner[face[first]][sharp],
    )


def one_in_each_cube(points: Float[np.ndarray, "n 3"], spacing: float) -> Int[np.ndarray, "m"]:
    """Returns the numbers of the first points in the cubes of a grid."""
    cubes = np.floor(points / spacing).astype(np.int64)
    cubes -= cubes.min(axis=0, initial=0)
    size = cubes.max(axis=0, initial=0) + 1
    if float(size[0]) * float(size[1]) * float(size[2]) > _MOST_CUBES:
        return np.unique(cubes, axis=0, return_index=True)[1]
    return np.unique((cubes[:, 0] * size[1] + cubes[:, 1]) * size[2] + cubes[:, 2], return_index=True)[1]


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Numbers of about `count` points, one in each cube of a grid where there are more."""
    spacing = 1e-4
    while True:
        first = one_in_each_cube(points, spacing)
        if len(first) <= count:
            return first
        spacing *= 1.2
