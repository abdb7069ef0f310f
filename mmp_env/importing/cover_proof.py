"""Proof that spheres cover the surface of a link.

The surface is a set of triangles. A triangle lies in a ball if its three corners do, because a ball is convex. A
triangle that lies in no single ball is cut in two at its longest edge, until every part lies in one or is too small.
Triangles that lie inside another piece of the same link are no surface and need no cover.

The proof says nothing about the inside of a link, and it need not: another body that is outside at first can only come
inside through the surface. A body must therefore not begin inside a link, deeper than its spheres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env import core
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import Piece

SMALLEST_EDGE_M = 5e-5
"""Longest edge [m] of a part that is not cut any more, but reported as a gap."""
_MOST_PARTS = 4_000_000
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Gaps:
    """Parts of a surface that no sphere is proved to cover: their middles [g, 3] [m], and how far outside [m] they are.

    `outside` is measured at the middle and the corners of a part, and is never 0. `area` is that of all parts [m2].
    `budget_spent` tells that the proof ended early.
    """

    points: Float[np.ndarray, "g 3"]
    outside: Float[np.ndarray, "g"]
    area: float = 0.0
    budget_spent: bool = False

    @property
    def uncovered_mm(self) -> float:
        """Largest distance [mm] of the parts from the spheres; 0 only where the whole surface is covered."""
        return float(self.outside.max(initial=0.0)) * 1e3


def prove_cover(
    shape: LinkShape,
    centers: Float[np.ndarray, "s 3"],
    radii: Float[np.ndarray, "s"],
    smallest: float = SMALLEST_EDGE_M,
) -> Gaps:
    """Returns the gaps that spheres leave in the surface of a shape. There is none where the cover is proved."""
    inside_one = np.array([_lies_in_one(piece, centers, radii) for piece in shape.pieces])[shape.owner]
    parts, thick, owner = (x[~inside_one] for x in (shape.triangles, shape.thickness, shape.owner))
    points, outside, area, done = [], [], 0.0, 0
    while len(parts):
        done += len(parts)
        middles = (parts[:, 0] + parts[:, 1] + parts[:, 2]) / 3
        ball, out = core.deepest_balls(middles, centers, radii)
        open_ = ~_in_ball(parts, thick, centers[ball], radii[ball])
        parts, thick, owner, middles, out = parts[open_], thick[open_], owner[open_], middles[open_], out[open_]
        visible = ~shape.inside_another(parts, owner)
        parts, thick, owner, middles, out = (x[visible] for x in (parts, thick, owner, middles, out))
        if not len(parts):
            break
        edges = _lengths(parts - np.roll(parts, -1, axis=1))
        longest, size = edges.argmax(axis=1), edges.max(axis=1)
        # A middle that may lie in another piece is no gap yet.
        final = (size <= smallest) | ((out + thick > 0) & ~shape.inside_another(middles[:, None].repeat(3, 1), owner))
        if done > _MOST_PARTS:
            final[:] = True
        if final.any():
            corners = parts[final].reshape(-1, 3)
            away = core.deepest_balls(corners, centers, radii)[1].reshape(-1, 3).max(axis=1)
            points.append(middles[final])
            area += _area(parts[final])
            outside.append(np.maximum(np.maximum(out[final], away) + thick[final], smallest))
        parts, thick, owner, longest = parts[~final], thick[~final], owner[~final], longest[~final]
        parts = _halved(parts, longest)
        thick, owner = np.tile(thick, 2), np.tile(owner, 2)
    if not points:
        return Gaps(points=np.empty((0, 3)), outside=np.empty(0))
    spent = done > _MOST_PARTS
    return Gaps(points=np.concatenate(points), outside=np.concatenate(outside), area=area, budget_spent=spent)


def _lies_in_one(piece: Piece, centers: np.ndarray, radii: np.ndarray) -> bool:
    """Whether a whole piece lies in a single ball."""
    farthest = np.linalg.norm(piece.vertices[:, None] - centers, axis=2).max(axis=0)
    return bool((farthest + piece.radius <= radii - _ROUNDING).any())


def _in_ball(parts: np.ndarray, thick: np.ndarray, centers: np.ndarray, radii: np.ndarray) -> Bool[np.ndarray, "n"]:
    """Which thickened triangles [n, 3, 3] lie in their ball, one each."""
    away = _lengths(parts - centers[:, None])
    farthest = np.maximum(np.maximum(away[:, 0], away[:, 1]), away[:, 2])
    return farthest <= radii - thick - _ROUNDING


def _lengths(vectors: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "..."]:
    """Returns the lengths of vectors. NumPy's `norm` takes several times as long for vectors of three numbers."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.sqrt(x * x + y * y + z * z)


def _area(triangles: Float[np.ndarray, "n 3 3"]) -> float:
    """Returns the area of all triangles together."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return float(_lengths(np.cross(b - a, c - a)).sum()) / 2


def protrusion(shape: LinkShape, centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]) -> float:
    """Returns the largest distance [m] from the surface of any sphere to the shape, bounded from above.

    A point of the sphere is at most as far from the shape as the radius exceeds the depth of the centre in one piece.
    A centre must lie inside; for one outside the result is infinite.
    """
    depth = shape.depth(centers)
    return float(np.where(depth >= -_ROUNDING, radii - depth, np.inf).max(initial=0.0))


def _halved(parts: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Both halves of triangles that are cut at the middle of their edge from corner `longest` to the next."""
    rows = np.arange(len(parts))
    a, b, c = (parts[rows, (longest + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
