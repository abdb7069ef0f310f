"""The checker's own reading of a plan.json. It shares no code with the readers of `mmp_env.files`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.asked import Asked, read_asked
from mmp_env.check.checked import CheckedArm, CheckedCell, CheckedPlan, Solid
from mmp_env.check.fields import (
    LARGEST_M,
    LEAST_MARGIN_M,
    UnreadableError,
    known,
    lengths,
    listed,
    margin_m,
    member,
    name,
    numbers,
    pose,
    positive,
    shown,
    text,
)
from mmp_env.check.held import BODY
from mmp_env.check.keep import read_keep
from mmp_env.check.models import CarriedModels

SCHEMA = "mmp-plan/1"
_SIZES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "mesh": ("pieces",),
}
_MOST_PIECES, _VERTICES = 200, (4, 1000)
"""Largest number of the pieces of a mesh, and bounds of the number of their vertices."""
_PLAN_KEYS = ("schema", "problem", "times", "positions", "velocities", "accelerations", "planner", "stats")
_POSE_KEYS = ("position", "yaw", "quaternion")
_CELL_KEYS = ("name", "arms", "obstacles", "spheres", "robots", "tools", "joints")
_LIMITS = ("max_velocity", "max_acceleration", "max_jerk")
_PROBLEM_KEYS = ("name", "cell", "start", "goal", *_LIMITS, "margin", "margins", "goal_asked", "keep")
_MARGIN_KEYS = ("arms", "obstacles", "self")


def read_plan(data: Any) -> CheckedPlan:
    """Returns the plan in `data`, the content of a plan.json. Raises `UnreadableError`."""
    if member(data, "schema", "the plan") != SCHEMA:
        raise UnreadableError(f"schema is {shown(data['schema'])}; this checker reads '{SCHEMA}'")
    known(data, _PLAN_KEYS, "the plan")
    problem = member(data, "problem", "the plan")
    known(problem, _PROBLEM_KEYS, "problem")
    cell = read_cell(member(problem, "cell", "problem"))
    times = numbers(member(data, "times", "the plan"), (None,), "times")
    if times.size == 0:
        raise UnreadableError("times is empty; a plan has at least one", "shape")

    dof = sum(arm.dof for arm in cell.arms)

    def limit(key: str) -> np.ndarray | None:
        given = problem.get(key)
        if given is None or isinstance(given, Mapping):
            return None if given is None else positive(_by_arm(cell, given, key), key, (dof,))
        return np.full(dof, float(positive(given, key)))

    def rates(key: str) -> np.ndarray | None:
        return None if data.get(key) is None else _by_arm(cell, data[key], key, times.size)

    if data.get("accelerations") is not None and data.get("velocities") is None:
        raise UnreadableError("the plan has accelerations and no velocities")
    start = _by_arm(cell, member(problem, "start", "problem"), "start")
    least = LEAST_MARGIN_M * (2 if problem.get("margins") is None else 1)
    margin = margin_m(member(problem, "margin", "problem"), "margin", least)
    max_velocity = limit("max_velocity")
    if max_velocity is None:
        raise UnreadableError("problem has no 'max_velocity'")
    return CheckedPlan(
        cell=cell,
        margin=margin,
        margins=_margins(problem.get("margins"), margin),
        times=times,
        positions=_by_arm(cell, member(data, "positions", "the plan"), "positions", times.size),
        start=start,
        asked=_asked(problem.get("goal_asked"), cell, start),
        goal=_by_arm(cell, member(problem, "goal", "problem"), "goal"),
        max_velocity=max_velocity,
        max_acceleration=limit("max_acceleration"),
        max_jerk=limit("max_jerk"),
        velocities=rates("velocities"),
        accelerations=rates("accelerations"),
        keep=read_keep(problem.get("keep"), [arm.name for arm in cell.arms]),
    )


def read_cell(data: Any) -> CheckedCell:
    """Returns the cell of a plan.json. Raises `UnreadableError`."""
    known(data, _CELL_KEYS, "cell")
    models = CarriedModels.read(data.get("robots"), data.get("tools"))
    arms = tuple(_arm(entry, models, f"arm {k}") for k, entry in enumerate(listed(data, "arms", "cell")))
    entries = enumerate(listed(data, "obstacles", "cell", optional=True))
    obstacles = [_obstacle(entry, f"obstacle {k}") for k, entry in entries]
    solids = tuple(solid for pieces in obstacles for solid in pieces)
    if not arms:
        raise UnreadableError("the cell has no arms")
    for kind, names in (("arms", [arm.name for arm in arms]), ("obstacles", [pieces[0].name for pieces in obstacles])):
        if len(set(names)) < len(names):
            raise UnreadableError(f"two {kind} of the cell have the same name")
    moving = {f"{arm.name}/{link}" for arm in arms for link in (*arm.robot.links[1:], *_beyond_links(arm))}
    for solid in solids:
        if strange := sorted(solid.may_touch - moving):
            where = f"may_touch of obstacle '{solid.name}'"
            raise UnreadableError(f"{where} names {shown(strange[0])}, which is no moving part of an arm of the cell")
    spheres = data.get("spheres")
    if spheres is None:
        bodies = [model for arm in arms for model in (arm.robot, arm.tool) if model]
        spheres = "exact" if all(model.has_exact_geometry for model in bodies) else "fine"
    spheres = spheres if isinstance(spheres, str) else shown(spheres)
    if spheres not in ("28", "fine", "exact"):
        raise UnreadableError(f"spheres of the cell is '{spheres}'; known: 28, fine, exact")
    return CheckedCell(arms=arms, solids=solids, spheres=spheres)


def _beyond_links(arm: CheckedArm) -> list[str]:
    """Returns the names of the tool and of the held object of an arm."""
    return [*([arm.tool.name] if arm.tool else []), *([BODY] if arm.held else [])]


def read_objects(data: Any) -> list[Solid]:
    """Returns objects, which are solids that arms can hold. Raises `UnreadableError`."""
    solids = [_solid(entry, f"object {k}") for k, entry in enumerate(data)]
    names = [solid.name for solid in solids]
    if len(set(names)) < len(names):
        raise UnreadableError("two objects have the same name")
    return solids


def _margins(data: Any, margin: float) -> dict[str, float]:
    """Returns the clearances [m] to keep, by kind: half of `margin` for an older plan without margins."""
    if data is None:
        return dict.fromkeys(_MARGIN_KEYS, margin / 2)
    known(data, _MARGIN_KEYS, "margins")
    out = {key: margin_m(member(data, key, "margins"), f"margins.{key}") for key in _MARGIN_KEYS}
    if out["arms"] != margin:
        raise UnreadableError(f"margin is {margin:g} and margins.arms {out['arms']:g}; they are the same")
    return out


def _arm(data: Any, models: CarriedModels, where: str) -> CheckedArm:
    known(data, ("name", "robot", "tool", "held", *_POSE_KEYS), where)
    arm = name(data, where)
    robot = models.robot(text(data, "robot", f"arm '{arm}'"))
    tool = data.get("tool", robot.data["default_tool"])
    tool = None if tool in (None, "none") else models.tool(text({"tool": tool}, "tool", f"arm '{arm}'"))
    position, quaternion = pose(data, f"arm '{arm}'")
    held = data.get("held")
    if held is not None:
        held = _solid({"name": "held", **held} if isinstance(held, Mapping) else held, f"held of arm '{arm}'")
    return CheckedArm(name=arm, robot=robot, tool=tool, position=position, quaternion=quaternion, held=held)


def _obstacle(data: Any, where: str) -> list[Solid]:
    """Returns the pieces of an obstacle with the links that may touch it."""
    if not isinstance(data, Mapping):
        raise UnreadableError(f"{where} is {shown(data)}; it must be an object")
    links = listed(data, "may_touch", where, optional=True)
    if not all(isinstance(link, str) for link in links):
        raise UnreadableError(f"may_touch of {where} is {shown(links)}; it must be a list of links")
    speed = float(numbers(data.get("speed", 0.0), (), f"speed of {where}"))
    if not 0 <= speed < np.inf:
        raise UnreadableError(f"speed of {where} is {speed:g}; it must be a number, 0 or more")
    solid = {key: value for key, value in data.items() if key not in ("may_touch", "speed")}
    return [replace(piece, may_touch=frozenset(links), speed=speed) for piece in _solids(solid, where)]


def _solids(data: Any, where: str) -> list[Solid]:
    """Returns the pieces of an obstacle: itself, unless it is a mesh."""
    if text(data, "shape", where, tuple(_SIZES)) != "mesh":
        return [_solid(data, where)]
    known(data, ("name", "shape", *_SIZES["mesh"], *_POSE_KEYS), f"{where}, a mesh")
    mesh = name(data, where)
    where = f"{where} ('{mesh}')"
    position, quaternion = pose(data, where)
    pieces = listed(data, "pieces", where)
    if not 1 <= len(pieces) <= _MOST_PIECES:
        raise UnreadableError(f"{where} has {len(pieces)} pieces; a mesh has 1 to {_MOST_PIECES}")
    return [
        Solid(
            name=mesh,
            shape="mesh",
            size=np.zeros(3),
            position=position,
            quaternion=quaternion,
            piece=k,
            vertices=_vertices(piece, f"piece {k} of {where}"),
        )
        for k, piece in enumerate(pieces)
    ]


def _vertices(data: Any, where: str) -> Float[np.ndarray, "v 3"]:
    vertices = numbers(data, (None, 3), where)
    if not _VERTICES[0] <= len(vertices) <= _VERTICES[1]:
        raise UnreadableError(f"{where} has {len(vertices)} vertices; a piece has {_VERTICES[0]} to {_VERTICES[1]}")
    if not (np.abs(vertices) <= LARGEST_M).all():
        raise UnreadableError(f"the vertices of {where} must be numbers within {LARGEST_M:g} m")
    return vertices


def _solid(data: Any, where: str) -> Solid:
    """Returns a solid that is no mesh."""
    shape = text(data, "shape", where, tuple(_SIZES)[:-1])
    known(data, ("name", "shape", *_SIZES[shape], *_POSE_KEYS), f"{where}, a {shape}")
    solid = name(data, where)
    where = f"{where} ('{solid}')"
    size = np.zeros(3)
    if shape == "box":
        size[:] = lengths(member(data, "size", where), f"size of {where}", (3,)) / 2
    else:
        size[0] = lengths(member(data, "radius", where), f"radius of {where}")
        if shape != "sphere":
            size[1] = lengths(member(data, "length", where), f"length of {where}") / 2
    position, quaternion = pose(data, where)
    return Solid(name=solid, shape=shape, size=size, position=position, quaternion=quaternion)


def _asked(data: Any, cell: CheckedCell, start: Float[np.ndarray, "n"]) -> dict[str, Asked]:
    """Returns arm name -> what was asked for, empty where only configurations were. Raises `UnreadableError`."""
    return {} if data is None else read_asked(data, _named(cell, start))


def _named(cell: CheckedCell, start: Float[np.ndarray, "n"]) -> dict[str, dict[str, Float[np.ndarray, "dof"]]]:
    """Returns arm name -> name -> configuration [rad or m], `stay` for the start."""
    parts = np.split(start, np.cumsum([arm.dof for arm in cell.arms])[:-1])
    return {
        arm.name: {"stay": part}
        | {key: numbers(arm.robot.data[key], (arm.dof,), f"{key} of arm '{arm.name}'") for key in ("home", "tucked")}
        for arm, part in zip(cell.arms, parts, strict=True)
    }


def _by_arm(cell: CheckedCell, data: Any, key: str, rows: int | None = None) -> np.ndarray:
    """Returns the configurations of all arms side by side, or one row of them for each time."""
    known(data, [arm.name for arm in cell.arms], key)
    columns = []
    for arm in cell.arms:
        shape = (arm.dof,) if rows is None else (rows, arm.dof)
        columns.append(numbers(member(data, arm.name, key), shape, f"{key} of arm '{arm.name}'"))
    return np.concatenate(columns, axis=-1)
