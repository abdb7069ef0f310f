"""The solid shape of one link: the union of its convex pieces, for fitting and proving sphere covers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.importing.pieces import Piece
from mmp_env.meshes.polytope import Polytope, polytope


class LinkShape:
    """Union of convex pieces.

    Its surface lies in the `triangles` [t, 3, 3] [m], each thickened by `thickness` [t] [m]. `owner` [t] is the piece
    of a triangle and `normals` [t, 3] point outwards.
    """

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self.pieces = tuple(pieces)
        self._solids: list[tuple[Polytope | None, Piece]] = []
        triangles, thickness, owner = [], [], []
        for number, piece in enumerate(pieces):
            is_round = len(piece.vertices) <= 2
            outline = piece.outline() if is_round else polytope(piece.vertices)
            self._solids.append((None if is_round else outline, piece))
            triangles.append(outline.vertices[outline.triangles])
            thickness.append(np.full(len(outline.triangles), 0.0 if is_round else piece.radius))
            owner.append(np.full(len(outline.triangles), number))
        self.triangles: Float[np.ndarray, "t 3 3"] = np.concatenate(triangles)
        self.thickness: Float[np.ndarray, "t"] = np.concatenate(thickness)
        self.owner: Int[np.ndarray, "t"] = np.concatenate(owner)
        self.thickness_of = np.array([0.0 if o is None else p.radius for o, p in self._solids])
        self._middles = [self.triangles[self.owner == k].reshape(-1, 3).mean(axis=0) for k in range(len(self.pieces))]
        self._boxes = [
            (piece.vertices.min(axis=0) - piece.radius, piece.vertices.max(axis=0) + piece.radius) for piece in pieces
        ]
        cross = np.cross(self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0])
        length = np.linalg.norm(cross, axis=1)
        self.areas: Float[np.ndarray, "t"] = length / 2
        self.normals: Float[np.ndarray, "t 3"] = cross / np.maximum(length, 1e-30)[:, None]

    def depth(self, points: Float[np.ndarray, "n 3"], skip: int | None = None) -> Float[np.ndarray, "n"]:
        """Returns a lower bound of how deep [m] points lie inside the union, which is the deepest in any piece.

        It is negative, or minus infinity, for points that are outside all pieces, or in piece `skip` only.
        """
        out = np.full(len(points), -np.inf)
        for number in range(len(self._solids)):
            if number != skip:
                near = self._near(number, points)
                out[near] = np.maximum(out[near], self._depth_in(number, points[near]))
        return out

    def _near(self, number: int, points: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "m"]:
        """Numbers of the points in the box around a piece. A link of one piece has no use for that."""
        if len(self.pieces) == 1:
            return np.arange(len(points))
        low, high = self._boxes[number]
        return np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))

    def _depth_in(self, number: int, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        outline, piece = self._solids[number]
        if outline is None:
            return piece.radius - _distance_to_segment(points, piece.vertices[0], piece.vertices[-1])
        out = outline.depth(points)
        # Outside the hull, planes bound the distance from below only: a thickened corner is round.
        return np.where(out >= 0, out + piece.radius, out)

    def inside_another(
        self, triangles: Float[np.ndarray, "n 3 3"], owner: Int[np.ndarray, "n"]
    ) -> Bool[np.ndarray, "n"]:
        """Returns which triangles lie wholly inside one piece other than their own, and so in no surface."""
        out = np.zeros(len(triangles), dtype=bool)
        if len(self._solids) == 1:
            return out
        thick = self.thickness_of[owner]
        for number in range(len(self._solids)):
            rest = np.flatnonzero(~out & (owner != number))
            rest = rest[self._near(number, triangles[rest, 0])]
            if not len(rest):
                continue
            depth = self._depth_in(number, triangles[rest].reshape(-1, 3))
            out[rest] = (depth.reshape(-1, 3).min(axis=1) - thick[rest]) > 1e-9
        return out

    def nearest_pieces(self, points: Float[np.ndarray, "n 3"], most: int = 3) -> list[int]:
        """Returns the pieces to which most of the points belong, by how deep they lie."""
        if len(self.pieces) <= most:
            return list(range(len(self.pieces)))
        depth = np.array([self._depth_in(k, points) for k in range(len(self.pieces))])
        number, count = np.unique(depth.argmax(axis=0), return_counts=True)
        return [int(k) for k in number[np.argsort(-count, kind="stable")]]

    def middle(self, piece: int) -> Float[np.ndarray, "3"]:
        """Returns a point inside a piece."""
        return self._middles[piece]

    @property
    def size(self) -> float:
        """Largest edge [m] of the box around all pieces."""
        return float(np.ptp(self.triangles.reshape(-1, 3), axis=0).max())

    @property
    def volume(self) -> float:
        """Sum [m^3] of the volumes of the pieces, their thickened faces included, of which overlaps count twice."""
        solids = sum((outline or piece.outline()).volume for outline, piece in self._solids)
        return solids + float(self.areas @ self.thickness)


def _distance_to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    edge = b - a
    share = np.clip((points - a) @ edge / max(float(edge @ edge), 1e-30), 0, 1)
    return np.linalg.norm(points - a - share[:, None] * edge, axis=1)
