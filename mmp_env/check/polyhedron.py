"""Signed distances of points from convex polyhedra: the pieces of mesh obstacles."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.checked import Solid
from mmp_env.check.fields import UnreadableError, rotation
from mmp_env.mujoco_import import mujoco

_SAME_DIGITS = 9
"""Digits to which the normals of one face agree."""
_BATCH = 200_000
"""Pairs of a point and an edge that are measured at once; bounds the memory of a check."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Polyhedron:
    """The hull of `vertices` [v, 3] [m]: its `planes` [p, 4] (n, d), n.x <= d, and its `edges` [e, 2], by index.

    Rounding may give a wrong plane or edge. No distance relies on them: they suggest directions, and the vertices say
    by how much a direction separates a point from the hull.
    """

    vertices: Float[np.ndarray, "v 3"]
    planes: Float[np.ndarray, "p 4"]
    edges: Int[np.ndarray, "e 2"]

    def distance(
        self, points: Float[np.ndarray, "*n 3"], near: float
    ) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n 3"]]:
        """Returns the signed distance [m] of points, and a subgradient of it.

        The distance of a point outside is a lower bound if its nearest plane is farther than `near` [m].
        """
        flat = points.reshape(-1, 3)
        beyond = flat @ self.planes[:, :3].T - self.planes[:, 3]
        face = beyond.argmax(axis=1)
        value, slope = beyond[np.arange(len(flat)), face], self.planes[face, :3].copy()
        close = np.flatnonzero((value > 0) & (value <= near))
        size = max(_BATCH // max(len(self.edges), len(self.vertices)), 1)
        for k in range(0, len(close), size):
            some = close[k : k + size]
            gap, along = self._beside_edges(flat[some])
            better = gap > value[some]
            value[some[better]], slope[some[better]] = gap[better], along[better]
        return value.reshape(points.shape[:-1]), slope.reshape(points.shape)

    def _beside_edges(
        self, points: Float[np.ndarray, "k 3"]
    ) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k 3"]]:
        """Returns the gaps [m] along the directions from the nearest edges to points, and these directions."""
        start, along = self.vertices[self.edges[:, 0]], np.diff(self.vertices[self.edges], axis=1)[:, 0]
        square = np.einsum("ei,ei->e", along, along)
        share = (points @ along.T - np.einsum("ei,ei->e", start, along)) / square
        away = points[:, None] - start - np.clip(share, 0.0, 1.0)[:, :, None] * along
        nearest = np.einsum("kei,kei->ke", away, away).argmin(axis=1)
        away = away[np.arange(len(points)), nearest]
        length = np.linalg.norm(away, axis=1, keepdims=True)
        along = np.divide(away, length, out=np.tile([0.0, 0.0, 1.0], (len(points), 1)), where=length > 0)
        support = (along @ self.vertices.T).max(axis=1)
        return np.einsum("ki,ki->k", along, points) - support, along


@functools.lru_cache(maxsize=4096)
def polyhedron(solid: Solid) -> Polyhedron:
    """Returns a piece of a mesh in its obstacle's frame. MuJoCo finds its faces. Raises `UnreadableError`."""
    assert solid.vertices is not None
    spec = mujoco.MjSpec()
    convex = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    spec.add_mesh(name="piece", uservert=solid.vertices.ravel(), inertia=convex)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="piece")
    try:
        model = spec.compile()
    except ValueError as error:
        raise UnreadableError(f"MuJoCo does not take piece {solid.piece} of '{solid.name}': {error}") from None
    placed = model.mesh_vert @ rotation(model.mesh_quat[0]).T + model.mesh_pos[0]
    number = np.array([np.linalg.norm(solid.vertices - vertex, axis=1).argmin() for vertex in placed])
    faces = number[model.mesh_face]
    a, b, c = (solid.vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals = normals[np.linalg.norm(normals, axis=1) > 0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    _, first = np.unique(np.round(normals, _SAME_DIGITS), axis=0, return_index=True)
    normals = normals[np.sort(first)]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0)
    planes = np.column_stack([normals, (solid.vertices @ normals.T).max(axis=0)])
    return Polyhedron(vertices=solid.vertices, planes=planes, edges=edges)
