"""Tests of meshes, and their decomposition into convex pieces that contain them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError
from mmp_env.meshes.mesh_files import require
from mmp_env.meshes.polytope import polytope, spread_directions

FAR_M, FAR_SHARE = 0.03, 0.25
"""A mesh of a robot is decomposed if more than this share of its hull's surface is farther than this [m] from it."""
MOST_BAD_EDGES = 0.05
"""Largest share of the length of all edges that may belong to other than two triangles of opposite directions."""
_SAMPLES = 4000
_DECOMPOSITION = {
    "resolution": 500,
    "mcts_nodes": 8,
    "mcts_iterations": 40,
    "mcts_max_depth": 2,
    "seed": 0,
}
"""Options of CoACD: coarse and quick, because the pieces are completed afterwards."""
_DIRECTIONS = 200
"""Number of directions in which the extent of a piece is compared with triangles."""
_CHUNK = 4096
"""Number of triangles that are compared at once, to bound the memory."""
_EDGE_M, _EDGE_SHARE = 0.02, 0.005
"""Largest edge of the triangles that a piece takes over whole: [m], and relative to the mesh if that is more."""


@dataclass(frozen=True, kw_only=True)
class Decomposition:
    """When and how a mesh is decomposed.

    Attributes:
        far_m: distance [m] from the mesh that is far.
        far_share: largest share of the hull's surface that may be far from a mesh that stays whole.
        threshold: concavity at which CoACD stops, relative to the size of the mesh.
        most: largest number of pieces.
        fine: largest number of triangles that CoACD gets as they are. It gets a coarse copy of a larger mesh, and takes
            a third of the time.
    """

    far_m: float = FAR_M
    far_share: float = FAR_SHARE
    threshold: float = 0.1
    most: int = 12
    fine: int = 20_000


ROBOT = Decomposition()
"""The decomposition of the links of robots."""


def check_mesh(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> None:
    """Raises `MmpError` where triangles enclose no volume, do not close, or point inwards."""
    fault = mesh_fault(vertices, faces)
    if fault is not None:
        raise MmpError(fault)


def mesh_fault(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> str | None:
    """Returns what is wrong with a mesh whose triangles do not close or point inwards, or None.

    Raises:
        MmpError: if the mesh has no volume.
    """
    scale = float(np.ptp(vertices, axis=0).max(initial=0.0))
    if len(faces) < 4 or scale <= 0:
        raise MmpError("has no volume")
    # STL files repeat vertices: those at one place are one.
    _, same = np.unique(np.round(vertices / scale, 6), axis=0, return_inverse=True)
    corner = same.ravel()[faces]
    kept = (corner[:, 0] != corner[:, 1]) & (corner[:, 1] != corner[:, 2]) & (corner[:, 2] != corner[:, 0])
    corner, faces = corner[kept], faces[kept]
    start = np.concatenate([corner[:, 0], corner[:, 1], corner[:, 2]]).astype(np.int64)
    stop = np.concatenate([corner[:, 1], corner[:, 2], corner[:, 0]]).astype(np.int64)
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    _, number, count = np.unique(start * len(vertices) + stop, return_inverse=True, return_counts=True)
    here, there = np.unique(start * len(vertices) + stop), stop * len(vertices) + start
    found = np.searchsorted(here, there)
    found = np.minimum(found, len(here) - 1)
    opposite = np.where(here[found] == there, count[found], 0)
    bad = (count[number.ravel()] != 1) | (opposite != 1)
    if length[bad].sum() > MOST_BAD_EDGES * length.sum():
        share = length[bad].sum() / length.sum()
        return f"is not manifold: {share:.0%} of its edges do not join two triangles of equal orientation; repair it"
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    if np.einsum("ij,ij->i", a, np.cross(b, c)).sum() <= 0:
        return "is inverted: its triangles point inwards; flip them"
    return None


def is_far_from_convex(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"], how: Decomposition = ROBOT
) -> bool:
    """Returns whether a mesh is far from its hull."""
    hull = polytope(vertices)
    if float(np.ptp(vertices, axis=0).max()) < 4 * how.far_m:
        return False
    random = np.random.default_rng(0)
    tree = require("scipy.spatial").cKDTree(_surface_points(vertices, faces, 4 * _SAMPLES, random))
    away, _ = tree.query(_surface_points(hull.vertices, hull.triangles, _SAMPLES, random))
    return float((away > how.far_m).mean()) > how.far_share


def decomposed(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"], how: Decomposition = ROBOT
) -> list[Float[np.ndarray, "p 3"]]:
    """Returns the points of convex pieces that contain the whole surface of a mesh.

    CoACD suggests the pieces and guarantees nothing. So each triangle, cut until it is small, is added to the piece
    whose extent in some directions it exceeds least. The hull of a piece's points then contains its triangles.
    """
    coacd = require("coacd")
    coacd.set_log_level("error")
    suggested = coacd.run_coacd(
        coacd.Mesh(vertices, faces),
        threshold=how.threshold,
        max_convex_hull=how.most,
        preprocess_mode="auto" if len(faces) <= how.fine else "on",
        preprocess_resolution=30 if len(faces) <= how.fine else 50,
        **_DECOMPOSITION,
    )
    parts = []
    for points, _ in suggested:
        try:
            parts.append(polytope(np.asarray(points, dtype=float)).vertices)
        except MmpError:  # a flat part holds nothing
            continue
    if len(parts) < 2:
        return [vertices]
    triangles = _cut(vertices[faces], max(_EDGE_M, _EDGE_SHARE * float(np.ptp(vertices, axis=0).max())))
    nearest = np.array([_beyond(triangles, part) for part in parts]).argmin(axis=0)
    return [np.concatenate([part, triangles[nearest == k].reshape(-1, 3)]) for k, part in enumerate(parts)]


def _beyond(triangles: Float[np.ndarray, "t 3 3"], part: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "t"]:
    """Returns how far [m] triangles reach beyond the extent of a part in the direction in which they do so most."""
    directions = spread_directions(_DIRECTIONS)
    extent = (part @ directions.T).max(axis=0)
    out = np.empty(len(triangles))
    for k in range(0, len(triangles), _CHUNK):
        corners = triangles[k : k + _CHUNK].reshape(-1, 3)
        out[k : k + _CHUNK] = (corners @ directions.T - extent).max(axis=1).reshape(-1, 3).max(axis=1)
    return out


def _cut(triangles: np.ndarray, longest: float) -> np.ndarray:
    done: list[Any] = []
    while len(triangles):
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        small = edges.max(axis=1) <= longest
        done.append(triangles[small])
        rest, first = triangles[~small], edges[~small].argmax(axis=1)
        rows = np.arange(len(rest))
        a, b, c = (rest[rows, (first + k) % 3] for k in range(3))
        middle = (a + b) / 2
        triangles = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(done)


def _surface_points(vertices: np.ndarray, faces: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = random.choice(len(faces), count, p=area / area.sum())
    return np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), count), corners[chosen])
