"""Everything in a model that no arm moves, as obstacles of a cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.errors import MmpError
from mmp_env.importing.kinematic_tree import pose_matrix
from mmp_env.importing.pieces import Piece, geom_pieces
from mmp_env.importing.scene.mesh_outlines import mesh_outline
from mmp_env.model.arm import LARGEST_M, Obstacle
from mmp_env.model.robot import frozen_array
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import ModelTree

_GEOM = mujoco.mjtGeom
_PLANE_M = 10.0
"""Thickness [m] of the box that stands for a plane."""


def scene_obstacles(
    tree: ModelTree, data: Any, chosen: Mapping[int, frozenset[str]], around: Float[np.ndarray, "3"]
) -> tuple[Obstacle, ...]:
    """Returns the chosen geoms as obstacles, at the poses that they have in `data`.

    Args:
        tree: The model.
        data: Its state.
        chosen: Numbers of the geoms, each with the links that may touch it.
        around: The point [m] that the boxes which stand for planes are centred at.
    """
    return tuple(replace(_obstacle(tree, data, geom, around), may_touch=links) for geom, links in chosen.items())


def _obstacle(tree: ModelTree, data: Any, geom: int, around: Float[np.ndarray, "3"]) -> Obstacle:
    model, name = tree.model, tree.geom_names[geom]
    kind, size = _GEOM(int(model.geom_type[geom])), np.array(model.geom_size[geom], dtype=float)
    pose = pose_matrix(data.geom_xpos[geom], data.geom_xmat[geom])
    if kind == _GEOM.mjGEOM_PLANE:
        return _plane(name, pose, around)
    if kind == _GEOM.mjGEOM_BOX:
        measures: dict[str, Any] = {"shape": "box", "size": frozen_array(2 * size)}
    elif kind == _GEOM.mjGEOM_SPHERE:
        measures = {"shape": "sphere", "radius": float(size[0])}
    elif kind == _GEOM.mjGEOM_CAPSULE:
        measures = {"shape": "capsule", "radius": float(size[0]), "length": float(2 * size[1])}
    elif kind == _GEOM.mjGEOM_CYLINDER:
        measures = {"shape": "cylinder", "radius": float(size[0]), "length": float(2 * size[1])}
    else:
        measures = {"shape": "mesh", "pieces": (frozen_array(_outline(model, data, geom, name, pose)),)}
        size = np.abs(measures["pieces"][0]).max(axis=0)
    largest = 2 * float(size.max())
    if largest > LARGEST_M or np.abs(pose[:3, 3]).max() > LARGEST_M:
        raise MmpError(
            f"geom '{name}' is {largest:g} m large at {np.round(pose[:3, 3], 3).tolist()}; an obstacle"
            f" has edges of {LARGEST_M:g} m at most and lies within {LARGEST_M:g} m of the origin"
        )
    return Obstacle(name=name, position=frozen_array(pose[:3, 3]), quaternion=pose_quaternion(pose), **measures)


def _outline(model: Any, data: Any, geom: int, name: str, pose: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "v 3"]:
    """Returns the vertices of a polytope around an ellipsoid or around the convex hull of a mesh, in its frame."""
    shape = geom_pieces(model, data, geom, pose)
    if isinstance(shape, Piece):
        return shape.vertices
    try:
        return mesh_outline(shape)
    except MmpError as error:
        raise MmpError(f"geom '{name}': {error}") from None


def _plane(name: str, pose: Float[np.ndarray, "4 4"], around: Float[np.ndarray, "3"]) -> Obstacle:
    """Returns a large box whose upper face lies in a plane, below `around`."""
    normal = pose[:3, 2]
    foot = around - normal * float(normal @ (around - pose[:3, 3]))
    return Obstacle(
        name=name,
        shape="box",
        position=frozen_array(foot - normal * _PLANE_M / 2),
        quaternion=pose_quaternion(pose),
        size=frozen_array([LARGEST_M, LARGEST_M, _PLANE_M]),
    )


def pose_quaternion(pose: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4"]:
    """Returns the quaternion (wxyz) of the rotation of a pose."""
    out = np.zeros(4)
    mujoco.mju_mat2Quat(out, np.ascontiguousarray(pose[:3, :3]).ravel())
    return frozen_array(out / np.linalg.norm(out))


def unmoved_geoms(moved: Sequence[int], collides: Bool[np.ndarray, "g g"]) -> list[int]:
    """Returns the geoms that may touch one of the `moved` geoms of all arms, and are none of them."""
    out = np.asarray(collides[:, list(moved)].any(axis=1))
    out[list(moved)] = False
    return np.flatnonzero(out).tolist()
