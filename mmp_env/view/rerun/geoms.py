"""The MuJoCo geoms of a cell as rerun shapes, and the poses of their bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.view.rerun.sdk import entity_part, require

CELL, STAGE = "/cell", "/stage"
_LAST_GROUP = 2
"""Highest geom group that is shown, as in MuJoCo's own pictures."""


class CellGeoms:
    """Logs the geoms of a cell once, and then the poses of its bodies.

    Moving bodies are entities `/cell/<arm>/<link>`, fixed ones are under `/stage`. Geoms exist at all times, or, if not
    `static`, from the current time of the stream. With `arm`, only the links of that arm are logged, below `root`.
    """

    def __init__(
        self,
        stream: Any,
        cell: Cell,
        model: Any = None,
        *,
        static: bool = True,
        arm: str | None = None,
        root: str | None = None,
    ) -> None:
        from mmp_env.mujoco_import import mujoco
        from mmp_env.sim.scene import compile_scene

        self._mujoco, self._stream, self._static = mujoco, stream, static
        self.model = model = compile_scene(cell) if model is None else model
        self._data = mujoco.MjData(model)
        by_body: dict[int, list[int]] = {}
        for geom in np.flatnonzero(model.geom_group <= _LAST_GROUP).tolist():
            by_body.setdefault(int(model.geom_bodyid[geom]), []).append(geom)
        names = {body: model.body(body).name for body in by_body if body != 0}
        if arm is None:
            self._bodies = {body: f"{CELL}/{_entity(name)}" for body, name in names.items()}
        else:
            own = f"{arm}/"
            links = {body: name.removeprefix(own) for body, name in names.items() if name.startswith(own)}
            self._bodies = {body: f"{root}/{_entity(link)}" for body, link in links.items()}
        for body, geoms in by_body.items():
            if arm is None or body in self._bodies:
                self._log_geoms(self._bodies.get(body, STAGE), geoms)

    def log_pose(self, q: Float[np.ndarray, "n"]) -> None:
        """Logs the poses of the bodies at the joint positions `q` [n] [rad], for all times."""
        rerun, data = require(), self._data
        data.qpos[:] = q
        self._mujoco.mj_kinematics(self.model, data)
        for body, path in self._bodies.items():
            pose = rerun.Transform3D(translation=data.xpos[body], quaternion=data.xquat[body][[1, 2, 3, 0]])
            self._stream.log(path, pose, static=True)

    def send_poses(self, index: list[Any], q: Float[np.ndarray, "t n"]) -> None:
        """Sends the poses of the bodies for the joint positions `q` [t, n] [rad], a row per time of `index`."""
        model, data = self.model, self._data
        positions, quaternions = np.empty((len(q), model.nbody, 3)), np.empty((len(q), model.nbody, 4))
        for k, row in enumerate(q):
            data.qpos[:] = row
            self._mujoco.mj_kinematics(model, data)
            positions[k], quaternions[k] = data.xpos, data.xquat
        self.send_bodies(index, positions, quaternions)

    def send_bodies(
        self, index: list[Any], positions: Float[np.ndarray, "t b 3"], quaternions: Float[np.ndarray, "t b 4"]
    ) -> None:
        """Sends the bodies at `positions` [m] with `quaternions` (wxyz), both as MuJoCo has them."""
        rerun = require()
        xyzw = quaternions[..., [1, 2, 3, 0]].astype(np.float32)
        for body, path in self._bodies.items():
            columns = rerun.Transform3D.columns(
                translation=positions[:, body].astype(np.float32), quaternion=xyzw[:, body]
            )
            self._stream.send_columns(path, index, columns)

    def _log_geoms(self, path: str, geoms: Sequence[int]) -> None:
        by_shape: dict[int, list[int]] = {}
        for geom in geoms:
            by_shape.setdefault(int(self.model.geom_type[geom]), []).append(geom)
        by_shape.pop(int(self._mujoco.mjtGeom.mjGEOM_PLANE), None)  # the floor is infinite
        for shape, alike in by_shape.items():
            name, archetype = self._archetype(shape, np.array(alike))
            self._stream.log(f"{path}/{name}", archetype, static=self._static)

    def _archetype(self, shape: int, geoms: np.ndarray) -> tuple[str, Any]:
        rerun, types, model = require(), self._mujoco.mjtGeom, self.model
        size = model.geom_size[geoms]
        look: dict[str, Any] = {
            "quaternions": model.geom_quat[geoms][:, [1, 2, 3, 0]],
            "colors": self._colors(geoms),
            "fill_mode": "solid",
        }
        place = model.geom_pos[geoms]
        if shape == types.mjGEOM_CYLINDER:
            return "cylinders", rerun.Cylinders3D(lengths=2 * size[:, 1], radii=size[:, 0], centers=place, **look)
        if shape == types.mjGEOM_CAPSULE:  # rerun's capsules begin at their lower end
            down = np.array(
                [_turned(q, [0, 0, -half]) for q, half in zip(model.geom_quat[geoms], size[:, 1], strict=True)]
            )
            return "capsules", rerun.Capsules3D(
                lengths=2 * size[:, 1], radii=size[:, 0], translations=place + down, **look
            )
        if shape in (types.mjGEOM_SPHERE, types.mjGEOM_ELLIPSOID):
            half = size if shape == types.mjGEOM_ELLIPSOID else np.repeat(size[:, :1], 3, axis=1)
            return types(shape).name[7:].lower() + "s", rerun.Ellipsoids3D(half_sizes=half, centers=place, **look)
        if shape == types.mjGEOM_BOX:
            return "boxes", rerun.Boxes3D(half_sizes=size, centers=place, **look)
        if shape == types.mjGEOM_MESH:
            return "meshes", self._meshes(geoms)
        # Other shapes, such as height fields, are shown as their bounding boxes.
        middle, half = model.geom_aabb[geoms, :3], model.geom_aabb[geoms, 3:]
        center = place + [_turned(q, m) for q, m in zip(model.geom_quat[geoms], middle, strict=True)]
        return "others", rerun.Boxes3D(half_sizes=half, centers=center, **look)

    def _meshes(self, geoms: np.ndarray) -> Any:
        """Returns the faces of mesh geoms in the frame of their body, each with a normal of its own."""
        model, triangles = self.model, []
        for geom in geoms.tolist():
            mesh = model.geom_dataid[geom]
            first, vertex = model.mesh_faceadr[mesh], model.mesh_vertadr[mesh]
            faces = model.mesh_face[first : first + model.mesh_facenum[mesh]]
            turn = matrix_from_quaternion(model.geom_quat[geom])
            triangles.append(model.mesh_vert[vertex + faces] @ turn.T + model.geom_pos[geom])
        corners = np.concatenate(triangles)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
        return require().Mesh3D(
            vertex_positions=corners.reshape(-1, 3),
            vertex_normals=np.repeat(normals, 3, axis=0),
            vertex_colors=np.repeat(self._colors(geoms), [3 * len(each) for each in triangles], axis=0),
            triangle_indices=np.arange(3 * len(corners)).reshape(-1, 3),
            albedo_factor=[255, 255, 255, int(self._colors(geoms)[:, 3].min())],  # rerun ignores alpha of vertices
        )

    def _colors(self, geoms: np.ndarray) -> np.ndarray:
        materials = self.model.geom_matid[geoms]
        rgba = self.model.geom_rgba[geoms].copy()
        rgba[materials >= 0] = self.model.mat_rgba[materials[materials >= 0]]
        return np.rint(255 * rgba).astype(np.uint8)


def joined(cell: Cell, q: Mapping[str, Float[np.ndarray, "t dof"]]) -> Float[np.ndarray, "t n"]:
    """Returns the joint positions of all arms in the model's order [t, n] [rad], from arm -> [t, dof]."""
    return np.concatenate([q[name] for name in cell.arm_names], axis=1)


def _turned(quaternion: np.ndarray, vector: Any) -> np.ndarray:
    return matrix_from_quaternion(quaternion) @ np.asarray(vector, dtype=float)


def _entity(body: str) -> str:
    return "/".join(map(entity_part, body.split("/")))
