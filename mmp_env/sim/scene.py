"""A cell as one MuJoCo model, composed with MjSpec from the robots' and tools' MJCF.

Names: `<arm>/<link>` bodies, `<arm>/joint1`..., `<arm>/servo1`..., sites `<arm>/flange` and `<arm>/tool_point`, geoms
`obstacle/<name>` (`obstacle/<name>/<k>` for the pieces of a mesh), and a body and geom `<arm>/held` for a held object.
Bodies that are welded to the world never touch each other in MuJoCo, so bases may overlap the table and each other. Two
parts of one arm collide here only if the planners test them against each other.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, is_out_of_memory
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.held import HELD
from mmp_env.model.hulls import Hull
from mmp_env.model.joint_chain import untested_pairs
from mmp_env.model.robot import EXACT, Robot, Tool
from mmp_env.mujoco_import import mujoco, without_log
from mmp_env.sim.arm_colors import arm_color
from mmp_env.sim.scene_appearance import OBJECT_RGBA, obstacle_rgba, set_stage

TIMESTEP_S = 0.002
"""Physics time step. The damping of the stiff servos is integrated implicitly."""
HELD_DENSITY = 300.0
"""Density of held objects [kg/m^3], that of light wood or a filled carton."""
OBSTACLE_PREFIX = "obstacle/"
BODY_MATERIAL = "body"
"""Material in the MJCF of a robot that gets the colour of the arm."""
_OWN_LOOK = {"material": "", "contype": 1, "conaffinity": 1}
"""Attributes of hulls that the defaults of a robot's MJCF must not set."""
_HIDDEN_GROUP = 4
"""Group of geoms that the renderers do not draw."""

_SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


def compile_scene(
    cell: Cell,
    *,
    moving_setpoints: bool = False,
    bodies: Collection[str] = (),
    more: Callable[[Any], None] | None = None,
) -> Any:
    """Returns the `mujoco.MjModel` of a cell, with floor, light and a camera `overview`, which touch nothing.

    Args:
        cell: the cell.
        moving_setpoints: False: `ctrl` holds the set points of the servos [rad]. True: the activations `act` hold them,
            and `ctrl` is their velocity [rad/s] (MuJoCo's `intvelocity`), so a straight reference needs one command.
        bodies: names of obstacles that are bodies of their own, so that contacts with them can be excluded.
        more: adds to the spec before it is compiled.

    Raises:
        MmpError: if MuJoCo refuses the MJCF of a robot or tool, or the composed model.
        MemoryError: if MuJoCo gets no memory.
    """
    spec = mujoco.MjSpec()
    spec.modelname = cell.name
    spec.compiler.degree = False
    spec.option.timestep = TIMESTEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # By default MuJoCo lets each body overlap its parent; a held object could then not touch the second to last link.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    for obstacle in cell.obstacles:
        own = bool(obstacle.may_touch) or obstacle.name in bodies
        _add_solid(spec, obstacle, obstacle_rgba(cell, obstacle), own_body=own)
    for number, arm in enumerate(cell.arms):
        _add_arm(spec, arm, number, cell.spheres)
    for obstacle in cell.obstacles:
        for link in sorted(obstacle.may_touch):
            spec.add_exclude(bodyname1=OBSTACLE_PREFIX + obstacle.name, bodyname2=link)
    if moving_setpoints:
        for servo in spec.actuators:
            servo.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    if more is not None:
        more(spec)
    set_stage(spec, cell)
    try:
        with without_log():
            return spec.compile()
    except ValueError as error:
        raise _refused(f"MuJoCo cannot compile cell '{cell.name}'", error) from error


def _refused(words: str, error: ValueError) -> MmpError | MemoryError:
    """Returns why MuJoCo does not take a model. Too little memory is no fault of the model."""
    return MemoryError(f"{words}: no memory") if is_out_of_memory(error) else MmpError(f"{words}: {error}")


def _add_solid(spec: Any, obstacle: Obstacle, rgba: tuple[float, float, float, float], *, own_body: bool) -> None:
    """Adds the geom `obstacle/<name>`, or `obstacle/<name>/<k>` for each piece of a mesh."""
    name = OBSTACLE_PREFIX + obstacle.name
    # MuJoCo excludes contacts of bodies, not of geoms.
    body = spec.worldbody.add_body(name=name) if own_body else spec.worldbody
    if not obstacle.pieces:
        _add_geom(body, name, obstacle, rgba)
    for k, piece in enumerate(obstacle.pieces):
        part = f"{name}/{k}"
        spec.add_mesh(name=part, uservert=piece.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
        place = {"pos": obstacle.position, "quat": obstacle.quaternion, "rgba": rgba}
        body.add_geom(name=part, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=part, **place)


def _add_geom(body: Any, name: str, solid: Obstacle, rgba: tuple[float, float, float, float]) -> Any:
    shape, size = _SHAPES[solid.shape], solid.half_size
    return body.add_geom(name=name, type=shape, size=size, pos=solid.position, quat=solid.quaternion, rgba=rgba)


def _add_arm(spec: Any, arm: Arm, number: int, sphere_set: str) -> None:
    prefix = f"{arm.name}/"
    robot = _read_mjcf(arm.robot)
    for link in arm.robot.link_names:
        if robot.body(link) is None:
            raise MmpError(f"{arm.robot.name}.xml has no body '{link}', which is a link of robot '{arm.robot.name}'")
    excluded = {frozenset((pair.bodyname1, pair.bodyname2)) for pair in robot.excludes}
    frame = spec.worldbody.add_frame(pos=arm.position, quat=arm.quaternion)
    spec.attach(robot, frame=frame, prefix=prefix)
    if arm.tool is not None:
        spec.attach(_read_mjcf(arm.tool), site=spec.site(f"{prefix}flange"), prefix=prefix)
    if arm.held is not None:
        add_held(spec, arm, arm.held, HELD)
    if sphere_set == EXACT:
        _collide_by_hulls(spec, arm)
    free = untested_pairs(arm, sphere_set) | {frozenset(arm.robot.link_names[:2])}
    for pair in free - excluded:
        first, second = sorted(pair)
        spec.add_exclude(bodyname1=prefix + first, bodyname2=prefix + second)
    material = spec.material(prefix + BODY_MATERIAL)
    if material is not None:
        material.rgba = [*arm_color(number), 1.0]


def _collide_by_hulls(spec: Any, arm: Arm) -> None:
    """Replaces the colliding geoms of an arm by its hulls, which are not drawn."""
    parts = {link: [hull for hull in arm.robot.hulls if hull.link == k] for k, link in enumerate(arm.robot.link_names)}
    if arm.tool is not None:
        parts[arm.tool.name] = list(arm.tool.hulls)
    for part, hulls in parts.items():
        body = spec.body(f"{arm.name}/{part}")
        for geom in body.geoms:
            geom.contype = geom.conaffinity = 0
        for k, hull in enumerate(hulls):
            _add_hull(spec, body, f"{arm.name}/hull/{part}/{k}", hull)


def _add_hull(spec: Any, body: Any, name: str, hull: Hull) -> None:
    """Adds a mesh, or a sphere or capsule for a hull of one or two vertices."""
    look = {"name": name, "group": _HIDDEN_GROUP, "density": 0.0, **_OWN_LOOK}
    if len(hull.vertices) > 2:
        spec.add_mesh(name=name, uservert=hull.vertices.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **look)
        return
    ends = hull.vertices[[0, -1]]
    length, turn = float(np.linalg.norm(ends[1] - ends[0])), np.array([1.0, 0.0, 0.0, 0.0])
    if length > 0:
        mujoco.mju_quatZ2Vec(turn, (ends[1] - ends[0]) / length)
    shape = mujoco.mjtGeom.mjGEOM_CAPSULE if length > 0 else mujoco.mjtGeom.mjGEOM_SPHERE
    body.add_geom(type=shape, size=[hull.radius, length / 2, 0.0], pos=ends.mean(axis=0), quat=turn, **look)


def add_held(spec: Any, arm: Arm, held: Obstacle, name: str) -> None:
    """Adds the body and geom `<arm>/<name>` of a held object, whose weight the arm's gravity compensation carries."""
    prefix = f"{arm.name}/"
    tool = spec.body(f"{prefix}{arm.tool.name}").add_frame() if arm.tool else None
    where = {"frame": tool} if tool else {"site": spec.site(f"{prefix}flange")}
    part = mujoco.MjSpec()
    body = part.worldbody.add_body(name=name, gravcomp=1.0)
    _add_geom(body, name, held, OBJECT_RGBA).density = HELD_DENSITY
    spec.attach(part, prefix=prefix, **where)


def add_object(spec: Any, solid: Obstacle, name: str) -> None:
    """Adds the body and geom `name` of an object that lies."""
    _add_geom(spec.worldbody.add_body(name=name), name, solid, OBJECT_RGBA)


def add_carried(spec: Any, solid: Obstacle, name: str) -> None:
    """Adds the body and geom `name` of an object that is carried: a mocap body, which moves only when it is placed."""
    body = spec.worldbody.add_body(name=name, mocap=True, pos=solid.position, quat=solid.quaternion)
    at_origin = replace(solid, position=np.zeros(3), quaternion=np.array([1.0, 0.0, 0.0, 0.0]))
    _add_geom(body, name, at_origin, OBJECT_RGBA)


def _read_mjcf(model: Robot | Tool) -> Any:
    """Returns a new spec of a robot or tool without its options and keyframes. Attaching consumes a spec."""
    try:
        with without_log():
            spec = mujoco.MjSpec.from_string(model.mjcf)
    except ValueError as error:
        raise _refused(f"{model.name}.xml is not MJCF that MuJoCo can read", error) from error
    spec.option = mujoco.MjSpec().option
    for key in list(spec.keys):
        spec.delete(key)
    return spec
