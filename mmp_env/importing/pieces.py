"""Convex pieces: what a link's collision geometry is made of.

A piece is the convex hull of points, thickened by a radius, and always contains its geom. Spheres and capsules are
exact. Boxes, and the polytopes around cylinders and ellipsoids, have radius 0. A mesh is the hull of some of its
vertices, with the radius that the others need.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.meshes.polytope import (
    ROUNDING_M,
    Polytope,
    corner_points,
    distances,
    polytope,
    rounded,
    spread_directions,
)

HULL_TOLERANCE_M = 0.0004
"""Largest radius [m] of the piece that stands for a mesh."""
_CURVE_TOLERANCE_M = 0.0005
_ROUND_DIRECTIONS = 300
_EXACT_VERTICES = 40


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """The convex hull of `vertices` [v, 3] [m] thickened by `radius` [m], in the frame of its link.

    `geom` says which MJCF geom it stands for: `{"type": ..., "size": ..., "pos": ..., "quat": ...}`; a mesh is made of
    the vertices themselves.
    """

    vertices: Float[np.ndarray, "v 3"]
    radius: float = 0.0
    geom: Mapping[str, Any] = field(default_factory=lambda: {"type": "mesh"})

    def outline(self) -> Polytope:
        """Returns a polytope that contains the piece: itself where the radius is 0."""
        if self.radius == 0.0:
            return polytope(self.vertices)
        if len(self.vertices) > 2:
            planes = polytope(self.vertices).planes
            planes[:, 3] += self.radius
            return polytope(corner_points(planes, self.vertices.mean(axis=0)))
        directions = np.concatenate([spread_directions(_ROUND_DIRECTIONS), _across(self.vertices)])
        offsets = (self.vertices @ directions.T).max(axis=0) + self.radius
        return polytope(corner_points(np.column_stack([directions, offsets]), self.vertices.mean(axis=0)))


def mesh_piece(points: Float[np.ndarray, "n 3"]) -> Piece:
    """Returns a piece that contains the convex hull of points, of few of these points and a radius.

    The vertex that lies farthest outside is added until all lie within `HULL_TOLERANCE_M` of the hull. The radius is
    the largest distance that is left, so that the piece contains the whole hull.
    """
    whole = polytope(points)
    vertices = whole.vertices
    if len(vertices) <= _EXACT_VERTICES:
        return Piece(vertices=rounded(vertices), radius=_up(2 * ROUNDING_M))
    directions = spread_directions(26)
    chosen = np.unique((vertices @ directions.T).argmax(axis=0))
    while True:
        hull = polytope(rounded(vertices[chosen]))
        outside = -hull.depth(vertices)
        rest = np.flatnonzero(outside > 0)
        if not len(rest) or outside.max() <= HULL_TOLERANCE_M:
            away = np.zeros(len(vertices))
            away[rest] = distances(vertices[rest], hull)
            if away.max() <= HULL_TOLERANCE_M:
                return Piece(vertices=hull.vertices, radius=_up(float(away.max()) + 2 * ROUNDING_M))
            outside = away
        chosen = np.concatenate([chosen, _farthest(vertices, outside)])


def _farthest(vertices: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """The vertex that is farthest outside, and others that are apart from it and from each other."""
    order = np.flatnonzero(outside > HULL_TOLERANCE_M)
    order = order[np.argsort(-outside[order])][:200]
    spacing = 0.15 * np.ptp(vertices, axis=0).max()
    picked: list[int] = []
    for k in order:
        if not picked or np.linalg.norm(vertices[picked] - vertices[k], axis=1).min() > spacing:
            picked.append(int(k))
    return np.array(picked)


def _up(value: float) -> float:
    """A length on the grid that is no less."""
    return round(float(np.ceil(value / ROUNDING_M)) * ROUNDING_M, 6)


def geom_pieces(model: Any, data: Any, geom: int, world: Float[np.ndarray, "4 4"]) -> Piece | Float[np.ndarray, "v 3"]:
    """Returns the piece of a primitive geom in the frame at `world`; of a mesh its vertices."""
    from mmp_env.mujoco_import import mujoco

    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    size = np.array(model.geom_size[geom], dtype=float)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
    pose = np.linalg.inv(world) @ pose

    def placed(points: Any) -> np.ndarray:
        return np.asarray(points, dtype=float) @ pose[:3, :3].T + pose[:3, 3]

    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, pose[:3, :3].ravel())
    shape = {"pos": pose[:3, 3].copy(), "quat": quaternion, "size": size}
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        return placed(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return Piece(vertices=placed(np.zeros((1, 3))), radius=float(size[0]), geom=shape | {"type": "sphere"})
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        ends = placed([[0, 0, -size[1]], [0, 0, size[1]]])
        return Piece(vertices=ends, radius=float(size[0]), geom=shape | {"type": "capsule"})
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * (size + 2 * ROUNDING_M)
        return Piece(vertices=rounded(placed(corners)), geom=shape | {"type": "box"})
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return Piece(vertices=rounded(placed(_prism(*size[:2]))), geom=shape | {"type": "cylinder"})
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        directions = spread_directions(_ROUND_DIRECTIONS)
        offsets = np.linalg.norm(directions * size, axis=1) + 2 * ROUNDING_M
        corners = corner_points(np.column_stack([directions, offsets]), np.zeros(3))
        return Piece(vertices=rounded(placed(corners)), geom=shape | {"type": "ellipsoid"})
    name = model.geom(geom).name or f"number {geom}"
    raise MmpError(f"geom '{name}' is a {kind.name.removeprefix('mjGEOM_').lower()}, which no link can carry")


def _prism(radius: float, half: float) -> np.ndarray:
    """The corners of a prism around a cylinder."""
    count = max(8, int(np.ceil(np.pi / np.arccos(radius / (radius + _CURVE_TOLERANCE_M)))))
    angle = 2 * np.pi * np.arange(count) / count
    out = (radius + 2 * ROUNDING_M) / np.cos(np.pi / count)
    ring = np.column_stack([out * np.cos(angle), out * np.sin(angle), np.full(count, half + 2 * ROUNDING_M)])
    return np.concatenate([ring, ring * [1, 1, -1]])


def _across(vertices: np.ndarray) -> np.ndarray:
    """Directions around the axis of a capsule, and along it."""
    if len(vertices) != 2:
        return np.empty((0, 3))
    axis = vertices[1] - vertices[0]
    length = np.linalg.norm(axis)
    if length < 1e-9:
        return np.empty((0, 3))
    axis = axis / length
    side = np.linalg.svd(axis[None])[2][1:]
    angle = 2 * np.pi * np.arange(32) / 32
    return np.cos(angle)[:, None] * side[0] + np.sin(angle)[:, None] * side[1]
