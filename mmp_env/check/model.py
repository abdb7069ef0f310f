"""The cell in MuJoCo, composed from the robots' MJCF, and its rigid parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.checked import CheckedArm, CheckedCell, Solid
from mmp_env.check.fields import UnreadableError, rotation
from mmp_env.check.held import BODY, held_spheres
from mmp_env.check.hulls import GrownMesh, add_hulls, in_geom_frames
from mmp_env.check.models import CheckedModel
from mmp_env.errors import is_out_of_memory
from mmp_env.mujoco_import import mujoco, without_log

_GEOMS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}

_CCD_TOLERANCE_M, _CCD_ITERATIONS = 1e-10, 200
"""Accuracy [m] and steps of MuJoCo's distances of meshes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Poses:
    """The cell at instants: `times` [m] [s], `q` [m, n] [rad or m], and the poses of all bodies in the world."""

    times: Float[np.ndarray, "m"]
    q: Float[np.ndarray, "m n"]
    positions: Float[np.ndarray, "m b 3"]
    rotations: Float[np.ndarray, "m b 3 3"]

    def __add__(self, other: Poses) -> Poses:
        return Poses(
            times=np.concatenate([self.times, other.times]),
            q=np.concatenate([self.q, other.q]),
            positions=np.concatenate([self.positions, other.positions]),
            rotations=np.concatenate([self.rotations, other.rotations]),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidParts:
    """Rigid parts, each carried by one body: the sphere cloud of a link or tool, or one geom.

    `arm` [p] is the index of the arm; `moves` [p, k] says whether joint k moves the part. A part lies in the ball about
    `center` [p, 3] [m] (in its body's frame) of `radius` [p] [m]. No point of it (centre of a sphere, or any point of a
    geom) moves by more than `reach` [p, k] per unit of joint k: its distance from the axis of a hinge [m], 1 for a
    slide, and 0 if k does not move it.
    """

    links: tuple[str, ...]
    arm: Int[np.ndarray, "p"]
    body: Int[np.ndarray, "p"]
    moves: Bool[np.ndarray, "p n"]
    center: Float[np.ndarray, "p 3"]
    radius: Float[np.ndarray, "p"]
    reach: Float[np.ndarray, "p n"]


class CellModel:
    """MuJoCo's model of a cell and its kinematics. Joints are side by side, arm after arm.

    `slides` [n] tells which joints slide along their axis, in m; the others turn about it, in rad.
    """

    def __init__(self, cell: CheckedCell, *, hulls: bool = False) -> None:
        """Args:
        cell: the cell.
        hulls: whether the hulls of hulls.json replace the geoms of the robots and tools.
        """
        self.cell = cell
        self.mujoco, meshes = _compile(cell, hulls=hulls)
        self.meshes = in_geom_frames(self.mujoco, meshes)
        joints = [self.mujoco.joint(f"{arm.name}/joint{k + 1}") for arm in cell.arms for k in range(arm.dof)]
        kinds = np.array([joint.type[0] for joint in joints])
        if not np.isin(kinds, (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)).all():
            raise UnreadableError("a joint neither turns nor slides; the motion bounds hold for hinges and slides")
        self.slides = kinds == mujoco.mjtJoint.mjJNT_SLIDE
        if (self.slides != cell.slides).any():
            raise UnreadableError("a joint slides in one of robot.json and the MJCF, and turns in the other")
        self._travel = cell.of_robots("lower"), cell.of_robots("upper")
        self._address = np.array([joint.qposadr[0] for joint in joints])
        self._column = {int(joint.id): k for k, joint in enumerate(joints)}
        self._data = mujoco.MjData(self.mujoco)
        self.place(np.zeros(len(joints)))
        # Anchors and axes of all joints with hinges and slides at 0; `reaches` does not depend on the angles.
        self._anchors = np.array([self._data.xanchor[joint.id] for joint in joints])
        self._axes = np.array([self._data.xaxis[joint.id] for joint in joints])
        self._reference = self.poses(np.zeros(1), np.zeros((1, len(joints))))

    def place(self, q: Float[np.ndarray, "n"]) -> mujoco.MjData:
        """Returns MuJoCo's data with all bodies and geoms placed at `q` [rad or m]; valid until the next call."""
        self._data.qpos[self._address] = q
        mujoco.mj_kinematics(self.mujoco, self._data)
        return self._data

    def poses(self, times: Float[np.ndarray, "m"], q: Float[np.ndarray, "m n"]) -> Poses:
        """Returns the cell at configurations `q` [rad or m]."""
        positions = np.empty((len(q), self.mujoco.nbody, 3))
        rotations = np.empty((len(q), self.mujoco.nbody, 9))
        for k, row in enumerate(q):
            data = self.place(row)
            positions[k], rotations[k] = data.xpos, data.xmat
        return Poses(times=times, q=q, positions=positions, rotations=rotations.reshape(*positions.shape, 3))

    def moves(self, body: int) -> Bool[np.ndarray, "n"]:
        """Returns which joints move a body."""
        out = np.zeros(len(self._address), dtype=bool)
        while body:
            first, count = self.mujoco.body_jntadr[body], self.mujoco.body_jntnum[body]
            out[[self._column[j] for j in range(first, first + count)]] = True
            body = int(self.mujoco.body_parentid[body])
        return out

    def reaches(
        self, body: int, points: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]
    ) -> Float[np.ndarray, "n"]:
        """Returns how far balls on a body move at most per unit of each joint, at any configuration within the limits.

        For a hinge this is their largest distance [m] from its axis, for a slide 1. Turned about the axis of the joint
        that carries it, a ball sweeps a set inside the ball about the foot of its centre on that axis, the distance of
        the two added to its radius. Along a slide it stays inside the ball about the middle of its travel, half the
        travel added to its radius. That ball is fixed in the next link inwards.
        """
        out = np.zeros(len(self._address))
        frame = self._reference
        centers = frame.positions[0, body] + points @ frame.rotations[0, body].T
        radii = np.array(radii)
        for k in np.flatnonzero(self.moves(body))[::-1]:
            if self.slides[k]:
                lower, upper = self._travel[0][k], self._travel[1][k]
                centers = centers + self._axes[k] * (lower + upper) / 2
                radii = radii + (upper - lower) / 2
                out[k] = 1.0
                continue
            foot = self._anchors[k] + np.outer((centers - self._anchors[k]) @ self._axes[k], self._axes[k])
            radii += np.linalg.norm(centers - foot, axis=1)
            centers = foot
            out[k] = radii.max()
        return out


@dataclass(frozen=True, kw_only=True, eq=False)
class LinkSpheres:
    """The spheres of one link or tool in its frame, and a ball around them (`center`, `radius`) [m]."""

    link: str
    centers: Float[np.ndarray, "s 3"]
    radii: Float[np.ndarray, "s"]
    center: Float[np.ndarray, "3"]
    radius: float


def sphere_parts(
    model: CellModel, holds: Sequence[tuple[int, Solid]] = ()
) -> tuple[RigidParts, tuple[LinkSpheres, ...]]:
    """Returns a part and its cloud for every link or tool that has spheres, and for held objects.

    Args:
        model: the cell.
        holds: more objects that arms hold at some time: index of the arm, and the object. Their parts come last.
    """
    rows, clouds = [], []
    models = {part for arm in model.cell.arms for part in (arm.robot, arm.tool) if part}
    by_model = {part: _clouds(part, model.cell.spheres) for part in models}
    for index, arm in enumerate(model.cell.arms):
        mine = by_model[arm.robot] + (by_model[arm.tool] if arm.tool else ())
        for cloud in mine + ((_cloud(BODY, held_spheres(arm.held)),) if arm.held else ()):
            body = model.mujoco.body(f"{arm.name}/{cloud.link}").id
            points = np.vstack([cloud.centers, cloud.center])
            reach = model.reaches(body, points, np.zeros(len(points)))
            rows.append((cloud.link, index, body, model.moves(body), cloud.center, cloud.radius, reach))
            clouds.append(cloud)
    for index, solid in holds:
        body, cloud = _held_cloud(model, model.cell.arms[index], solid)
        points = np.vstack([cloud.centers, cloud.center])
        reach = model.reaches(body, points, np.zeros(len(points)))
        rows.append((cloud.link, index, body, model.moves(body), cloud.center, cloud.radius, reach))
        clouds.append(cloud)
    return stack_parts(rows), tuple(clouds)


def _held_cloud(model: CellModel, arm: CheckedArm, solid: Solid) -> tuple[int, LinkSpheres]:
    """Returns the body that carries a held object, and its spheres in the frame of that body."""
    table = held_spheres(solid)
    if arm.tool:
        return model.mujoco.body(f"{arm.name}/{arm.tool.name}").id, _cloud(BODY, table)
    site = model.mujoco.site(f"{arm.name}/flange")
    table[:, :3] = table[:, :3] @ rotation(np.array(site.quat)).T + np.array(site.pos)
    return int(site.bodyid[0]), _cloud(BODY, table)


def _clouds(model: CheckedModel, spheres: str) -> tuple[LinkSpheres, ...]:
    if spheres == "exact" and spheres not in model.spheres:
        spheres = "fine"  # it covers the hulls as well
    return tuple(_cloud(link, table) for link, table in model.sphere_set(spheres).items())


def _cloud(link: str, table: Float[np.ndarray, "s 4"]) -> LinkSpheres:
    centers, radii = table[:, :3], table[:, 3]
    center, radius = enclosing_ball(centers, radii)
    return LinkSpheres(link=link, centers=centers, radii=radii, center=center, radius=radius)


def stack_parts(rows: Sequence[tuple]) -> RigidParts:
    """Returns parts from rows (link, arm, body, moves, centre, radius, reach)."""
    links, arm, body, moves, center, radius, reach = zip(*rows, strict=True)
    return RigidParts(
        links=links,
        arm=np.array(arm),
        body=np.array(body),
        moves=np.array(moves),
        center=np.array(center),
        radius=np.array(radius),
        reach=np.array(reach),
    )


def enclosing_ball(
    centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]
) -> tuple[Float[np.ndarray, "3"], float]:
    """Returns a small ball around spheres. Its centre moves to the farthest sphere in shrinking steps."""
    center = centers.mean(axis=0)
    for k in range(100):
        center = center + (centers[np.argmax(np.linalg.norm(centers - center, axis=1) + radii)] - center) / (k + 2)
    return center, float((np.linalg.norm(centers - center, axis=1) + radii).max())


def _compile(cell: CheckedCell, *, hulls: bool) -> tuple[mujoco.MjModel, dict[str, GrownMesh]]:
    spec = mujoco.MjSpec()
    spec.option.ccd_tolerance, spec.option.ccd_iterations = _CCD_TOLERANCE_M, _CCD_ITERATIONS
    meshes: dict[str, GrownMesh] = {}
    for solid in cell.solids:
        meshes |= _stand(spec, solid)
    for arm in cell.arms:
        frame = spec.worldbody.add_frame(pos=arm.position, quat=arm.quaternion)
        spec.attach(_mjcf(arm.robot), frame=frame, prefix=f"{arm.name}/")
        if arm.tool:
            spec.attach(_mjcf(arm.tool), site=spec.site(f"{arm.name}/flange"), prefix=f"{arm.name}/")
        if hulls:
            meshes |= add_hulls(spec, arm)
        if arm.held:
            _hold(spec, arm, arm.held)
    try:
        with without_log():
            return spec.compile(), meshes
    except ValueError as error:
        raise _refused("the cell", error) from None


def _stand(spec: mujoco.MjSpec, solid: Solid) -> dict[str, GrownMesh]:
    """Adds an obstacle, or a piece of one. Returns it by its geom if it is a mesh."""
    place = {"name": solid.geom, "pos": solid.position, "quat": solid.quaternion}
    if solid.vertices is None:
        spec.worldbody.add_geom(type=_GEOMS[solid.shape], size=solid.size, **place)
        return {}
    convex = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    spec.add_mesh(name=solid.geom, uservert=solid.vertices.ravel(), inertia=convex)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=solid.geom, **place)
    placed = solid.vertices @ rotation(solid.quaternion).T + solid.position
    return {solid.geom: GrownMesh(vertices=placed, radius=0.0)}


def _hold(spec: mujoco.MjSpec, arm: CheckedArm, held: Solid) -> None:
    """Adds a body that is fixed in the tool's frame, or in the flange's, which is the pose of a site."""
    if arm.tool:
        body = spec.body(f"{arm.name}/{arm.tool.name}").add_body()
    else:
        flange = spec.site(f"{arm.name}/flange")
        body = flange.parent.add_body(pos=flange.pos, quat=flange.quat)
    body.name = f"{arm.name}/{BODY}"
    body.add_geom(type=_GEOMS[held.shape], size=held.size, pos=held.position, quat=held.quaternion)


def _refused(what: str, error: ValueError) -> UnreadableError | MemoryError:
    """Returns why MuJoCo does not take a model. Too little memory is no fault of the model."""
    if is_out_of_memory(error):
        return MemoryError("MuJoCo got no memory")
    return UnreadableError(f"MuJoCo does not take {what}: {' '.join(str(error).split())}")


def _mjcf(model: CheckedModel) -> mujoco.MjSpec:
    try:
        with without_log():
            spec = mujoco.MjSpec.from_string(model.mjcf)
    except ValueError as error:
        raise _refused(f"{model.name}.xml", error) from None
    _test_names(spec, model)
    for key in list(spec.keys):  # of one robot alone: too short for a cell
        spec.delete(key)
    return spec


def _test_names(spec: mujoco.MjSpec, model: CheckedModel) -> None:
    """Raises `UnreadableError` for MJCF without the bodies, joints and site that a robot or tool has."""
    joints = [f"joint{k + 1}" for k in range(len(model.data.get("joints", ())))]
    if [joint.name for joint in spec.joints] != joints:
        raise UnreadableError(f"{model.name}.xml does not have the joints {', '.join(joints) or 'of a tool, none'}")
    for link in model.links:
        if spec.body(link) is None:
            raise UnreadableError(f"{model.name}.xml has no body '{link}'")
    if joints and spec.site("flange") is None:
        raise UnreadableError(f"{model.name}.xml has no site 'flange'")
