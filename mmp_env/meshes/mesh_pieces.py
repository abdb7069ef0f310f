"""The convex pieces of a mesh obstacle: polytopes of few vertices that together contain the surface of the mesh."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError
from mmp_env.meshes.decomposition import Decomposition, check_mesh, decomposed, is_far_from_convex
from mmp_env.meshes.mesh_files import MOST_TRIANGLES, require
from mmp_env.meshes.polytope import ROUNDING_M, corner_points, nearest_points, polytope, rounded

OBSTACLE = Decomposition(far_m=0.01, far_share=0.02, threshold=0.05, most=24, fine=MOST_TRIANGLES)
"""A mesh obstacle is decomposed if 2 % of its hull's surface is farther than 10 mm from it."""
OUTER_TOLERANCE_M, OUTER_TOLERANCE_SHARE = (0.001, 0.005), 0.01
"""Largest protrusion of a piece from the hull of its part: 1 % of its size, but 1 mm at least and 5 mm at most."""
_EXACT_VERTICES = 32
"""Largest number of vertices of a hull that is kept as it is."""
_CUTS = 8
"""Largest number of planes that are added at once."""
_SPACING_SHARE = 0.2
"""Least distance of corners that are cut off at once, relative to the size of the polytope."""
_MOST_BODIES = 100
"""Largest number of separate parts of a mesh that are decomposed one by one."""


def mesh_pieces(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> list[Float[np.ndarray, "_ 3"]]:
    """Returns the vertices [m] of convex pieces that together contain every triangle of a mesh.

    Raises:
        MmpError: if the mesh has no volume, is not closed, or is turned inside out.
    """
    check_mesh(vertices, faces)
    parts = []
    for body in _bodies(vertices, faces):
        points, own = _compact(vertices, body)
        if is_far_from_convex(points, own, OBSTACLE):
            parts += decomposed(points, own, OBSTACLE)
        else:
            parts.append(points)
    return [outer_hull(part) for part in parts]


def outer_hull(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "v 3"]:
    """Returns the vertices of a polytope that contains points, their hull if that has few vertices.

    The polytope of a larger hull begins as a box. Planes that touch the hull cut off the corners that protrude most.
    """
    hull = polytope(points)
    if len(hull.vertices) <= _EXACT_VERTICES:
        return hull.vertices
    low, high = OUTER_TOLERANCE_M
    allowed = min(max(OUTER_TOLERANCE_SHARE * float(np.ptp(hull.vertices, axis=0).max()), low), high)
    axes = np.linalg.svd(hull.vertices - hull.vertices.mean(axis=0), full_matrices=False)[2]
    normals = np.concatenate([axes, -axes])
    while len(normals) < len(hull.vertices):
        offsets = (hull.vertices @ normals.T).max(axis=0) + 2 * ROUNDING_M
        outer = polytope(rounded(corner_points(np.column_stack([normals, offsets]), hull.vertices.mean(axis=0))))
        beyond = outer.vertices @ hull.planes[:, :3].T - hull.planes[:, 3]
        cuts = hull.planes[beyond.argmax(axis=1), :3]
        length = beyond.max(axis=1)
        if length.max() <= allowed:  # no corner is far from a plane of the hull, but it may be far from the hull
            away = outer.vertices - nearest_points(outer.vertices, hull)
            length = np.linalg.norm(away, axis=1)
            cuts = away / np.maximum(length, ROUNDING_M)[:, None]
        if length.max() <= allowed:
            inside = (outer.depth(hull.vertices) >= 0).all()
            return outer.vertices if inside and len(outer.vertices) < len(hull.vertices) else hull.vertices
        worst = _far_apart(outer.vertices, np.where(length > allowed, length, 0.0))
        normals = np.concatenate([normals, cuts[worst]])
    return hull.vertices


def _far_apart(points: Float[np.ndarray, "n 3"], worth: Float[np.ndarray, "n"]) -> list[int]:
    """Returns the numbers of the points of the most worth that are far from each other; some if any has a worth."""
    spacing = _SPACING_SHARE * float(np.ptp(points, axis=0).max())
    out: list[int] = []
    for k in np.argsort(-worth, kind="stable").tolist():
        if worth[k] <= 0 or len(out) == _CUTS:
            break
        if not out or np.linalg.norm(points[out] - points[k], axis=1).min() > spacing:
            out.append(k)
    return out


def _bodies(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> list[np.ndarray]:
    """Returns the triangles of each separate part; all in one if there are many, or a cavity, which points inwards."""
    size = float(np.ptp(vertices, axis=0).max())
    _, same = np.unique(np.round(vertices / size, 6), axis=0, return_inverse=True)
    corner = same.ravel()[faces]
    links = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]]])
    count = int(corner.max()) + 1
    graph = require("scipy.sparse").coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), (count, count))
    _, label = require("scipy.sparse.csgraph").connected_components(graph, directed=False)
    of_face = label[corner[:, 0]]
    bodies = [faces[of_face == k] for k in np.unique(of_face)]
    if len(bodies) > _MOST_BODIES:
        return [faces]
    try:
        for body in bodies:
            check_mesh(*_compact(vertices, body))
    except MmpError:
        return [faces]
    return bodies


def _compact(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices that the triangles use, and the triangles of these."""
    used, number = np.unique(faces, return_inverse=True)
    return vertices[used], number.reshape(faces.shape).astype(np.int32)
