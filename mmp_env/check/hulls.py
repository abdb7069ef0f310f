"""Convex hulls from hulls.json as geoms of the checker's MuJoCo model, in place of the geoms of the MJCF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedArm
from mmp_env.check.fields import UnreadableError, rotation
from mmp_env.mujoco_import import mujoco

_LEAST_VERTICES = 4
"""Fewest vertices of a mesh. Pieces of one or two vertices are spheres and capsules."""

_OWN = {"material": "", "contype": 1, "conaffinity": 1}
"""Attributes of hulls that the defaults of the MJCF must not set."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GrownMesh:
    """A mesh geom: the hull of `vertices` [v, 3] [m] in the geom's frame, grown by a ball of `radius` [m]."""

    vertices: Float[np.ndarray, "v 3"]
    radius: float


def add_hulls(spec: mujoco.MjSpec, arm: CheckedArm) -> dict[str, GrownMesh]:
    """Adds the hulls of an arm, whose other geoms collide no more. Returns the meshes by geom, in their bodies' frames.

    Raises:
        UnreadableError: if the robot or its tool has no hulls.
    """
    bodies = {link: rows for model in (arm.robot, arm.tool) if model for link, rows in model.link_hulls().items()}
    out = {}
    for link, pieces in bodies.items():
        body = spec.body(f"{arm.name}/{link}")
        if body is None:
            raise UnreadableError(f"the hulls of arm '{arm.name}' name a body '{link}', which it does not have")
        for geom in body.geoms:
            geom.contype = geom.conaffinity = 0
        for k, piece in enumerate(pieces):
            geom = f"hull/{arm.name}/{link}/{k}"
            mesh = _add_piece(spec, body, geom, *piece)
            out |= {geom: mesh} if mesh else {}
    return out


def _add_piece(spec: Any, body: Any, name: str, vertices: np.ndarray, radius: float) -> GrownMesh | None:
    """Adds a sphere, a capsule or a mesh. Returns the mesh."""
    if len(vertices) < _LEAST_VERTICES:
        ends = vertices[[0, -1]]
        along = ends[1] - ends[0]
        length = float(np.linalg.norm(along))
        shape = mujoco.mjtGeom.mjGEOM_CAPSULE if length > 0 else mujoco.mjtGeom.mjGEOM_SPHERE
        quaternion = np.array([1.0, 0, 0, 0])
        if length > 0:
            mujoco.mju_quatZ2Vec(quaternion, along / length)
        body.add_geom(
            name=name, type=shape, size=[radius, length / 2, 0], pos=ends.mean(axis=0), quat=quaternion, **_OWN
        )
        return None
    spec.add_mesh(name=name, uservert=vertices.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **_OWN)
    return GrownMesh(vertices=vertices, radius=radius)


def in_geom_frames(model: mujoco.MjModel, meshes: Mapping[str, GrownMesh]) -> dict[int, GrownMesh]:
    """Returns the meshes by id of their geom, with vertices in the frame of the geom, which MuJoCo chooses.

    Meshes of the MJCF are not grown.
    """
    out = {
        geom: _mesh_of(model, geom) for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH).tolist()
    }
    for name, mesh in meshes.items():
        geom = model.geom(name).id
        vertices = (mesh.vertices - model.geom_pos[geom]) @ rotation(model.geom_quat[geom])
        out[geom] = GrownMesh(vertices=vertices, radius=mesh.radius)
    return out


def _mesh_of(model: mujoco.MjModel, geom: int) -> GrownMesh:
    mesh = int(model.geom_dataid[geom])
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    return GrownMesh(vertices=model.mesh_vert[first : first + count].astype(float), radius=0.0)
