"""Planes around convex hulls. Each plane touches its hull, so the largest distance from one never exceeds the true one.

The hull grows by one point at a time. New faces join the point to the outline of the faces that it sees, and replace
these. Rounding may give a wrong face, but never a plane that cuts the hull, because the vertices decide where each
plane lies.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

_SHARP_EDGE, _SHARP_CORNER = 0.5, 0.7
"""Cosines of the angles between the normals at an edge, and around a vertex, below which a plane is added there."""
_ROUNDING = 1e-10
"""Rounding of coordinates, relative to the size of the hull."""
_SAME_DIGITS = 7
"""Digits to which the normals of one face agree."""


def supporting_planes(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "p 4"]:
    """Returns planes (n, d) around the hull of vertices, n.x <= d: its faces, and planes at sharp edges and corners.

    There are none if all vertices lie in one plane.
    """
    faces = _faces(vertices)
    if faces is None:
        return np.empty((0, 4))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = _unit(np.cross(b - a, c - a))
    normals = np.concatenate([normals, *_bevels(faces, normals)])
    _, first = np.unique(np.round(normals, _SAME_DIGITS) + 0.0, axis=0, return_index=True)
    normals = normals[np.sort(first)]
    return np.column_stack([normals, (vertices @ normals.T).max(axis=0)])


def plane_distance(planes: Float[np.ndarray, "p 4"], points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
    """Returns the signed distance [m] of points from a hull: a lower bound beside edges, exact elsewhere."""
    return (points @ planes[:, :3].T - planes[:, 3]).max(axis=-1)


def thickness(vertices: Float[np.ndarray, "v 3"]) -> float:
    """Returns the width [m] of points across the plane that fits them best; 0 if all lie in one plane."""
    axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=False)[2]
    return float(np.ptp(vertices @ axes.T, axis=0).min())


def _faces(points: Float[np.ndarray, "v 3"]) -> np.ndarray | None:
    """Returns the triangles [t, 3] of the hull, outwards; None if the points lie in a plane."""
    room = _ROUNDING * max(float(np.abs(points).max(initial=0.0)), 1e-300)
    first = _tetrahedron(points, room)
    if first is None:
        return None
    inside = points[first].mean(axis=0)
    faces = np.array([np.delete(first, k) for k in range(4)])
    planes = _planes(points, faces)
    inwards = planes[:, :3] @ inside > planes[:, 3]
    faces[inwards] = faces[inwards][:, ::-1]
    planes[inwards] *= -1
    order = np.argsort(-np.linalg.norm(points - inside, axis=1), kind="stable")
    for k in order.tolist():
        sees = planes[:, :3] @ points[k] - planes[:, 3] > room
        if not sees.any():
            continue
        edges = {(int(f[i]), int(f[(i + 1) % 3])) for f in faces[sees] for i in range(3)}
        added = np.array([(i, j, k) for i, j in sorted(edges) if (j, i) not in edges], dtype=int).reshape(-1, 3)
        faces = np.concatenate([faces[~sees], added])
        planes = np.concatenate([planes[~sees], _planes(points, added)])
    return faces


def _tetrahedron(points: Float[np.ndarray, "v 3"], room: float) -> np.ndarray | None:
    """Returns the numbers of four points far apart; None if the points lie in a plane."""
    a = int(points[:, 0].argmin())
    away = points - points[a]
    b = int(np.linalg.norm(away, axis=1).argmax())
    across = np.cross(away, _unit(away[b]))
    c = int(np.linalg.norm(across, axis=1).argmax())
    if np.linalg.norm(away[b]) <= room or np.linalg.norm(across[c]) <= room:
        return None
    above = np.abs(away @ _unit(np.cross(away[b], away[c])))
    d = int(above.argmax())
    return None if above[d] <= room else np.array([a, b, c, d])


def _planes(points: Float[np.ndarray, "v 3"], faces: np.ndarray) -> Float[np.ndarray, "t 4"]:
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = _unit(np.cross(b - a, c - a))
    return np.column_stack([normals, np.einsum("ij,ij->i", normals, a)])


def _bevels(faces: np.ndarray, normals: Float[np.ndarray, "t 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the mean normals at sharp edges and at sharp corners."""
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    face = np.repeat(np.arange(len(faces)), 3)
    there = dict(zip(zip(starts.tolist(), ends.tolist(), strict=True), face.tolist(), strict=True))
    beside = [(k, there[j, i]) for (i, j), k in there.items() if i < j and (j, i) in there]
    one, other = np.array(beside, dtype=int).reshape(-1, 2).T
    sharp = np.einsum("ij,ij->i", normals[one], normals[other]) < _SHARP_EDGE
    corners = []
    for vertex in np.unique(faces).tolist():
        around = np.unique(np.round(normals[face[starts == vertex]], _SAME_DIGITS), axis=0)
        mean = _unit(around.sum(axis=0))
        if (around @ mean).min() < _SHARP_CORNER:
            corners.append(mean)
    return _unit(normals[one[sharp]] + normals[other[sharp]]), np.array(corners).reshape(-1, 3)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Returns vectors of length 1; one of length 0 becomes x."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), [1.0, 0.0, 0.0])
