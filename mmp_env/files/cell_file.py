"""Cells as files: the `cell` of instance and plan files, and cells alone as JSON or YAML (docs/reference/files.md)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float
from msgspec import UNSET, UnsetType

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.carried_models import (
    NO_TOOL,
    CarriedModels,
    carried_keys,
    carried_to_dict,
    read_carried,
)
from mmp_env.files.file_kinds import CELL, read_for
from mmp_env.files.paths import real_path
from mmp_env.files.reading import Location, decode, named
from mmp_env.files.solid_data import (
    HeldData,
    ObstacleData,
    Vector,
    check_name,
    pose_from_data,
    solid_from_data,
    solid_to_dict,
)
from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import MOST_ARMS, Cell
from mmp_env.model.model_joints import ModelJoints
from mmp_env.model.names import NAMES, is_name
from mmp_env.model.obstacle_fields import SHAPES
from mmp_env.model.robot import GEOMETRIES, Robot, Tool, finest_geometry, frozen_array
from mmp_env.model.robot_reading import load_robot, load_tool
from mmp_env.model.tool_pairs import fitted_tool
from mmp_env.robot_folders import find_tool, is_path
from mmp_env.wording import degrees_hint, shown

MAX_OBSTACLES = 1000
"""Largest numbers of arms and obstacles of a cell."""
_ONE_TURN_RAD = 2 * np.pi + 1e-4
"""Largest yaw [rad] in a cell file: a full turn, with room for rounding."""


class ArmData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    name: str
    robot: str
    position: Vector
    tool: str | UnsetType | None = UNSET
    tool_state: str | None = None
    yaw: float | None = None
    quaternion: tuple[float, float, float, float] | None = None
    held: HeldData | None = None


class JointsData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    names: dict[str, list[str]]
    addresses: dict[str, list[int]]
    qpos: list[float]


class CellData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    arms: list[ArmData]
    obstacles: list[ObstacleData] = []
    name: str | None = None
    spheres: str | int | None = None
    robots: dict[str, Any] = {}
    tools: dict[str, Any] = {}
    joints: JointsData | None = None


def load_cell(path: str | PathLike[str]) -> Cell:
    """Reads a cell from a JSON or YAML file. docs/reference/files.md describes the fields.

    Args:
        path: the file. Its stem names the cell if the file does not.

    Raises:
        MmpError: for a file that cannot be read, or a fault in it, with file, field and value.
    """
    return cell_from_dict(read_for("load_cell", path, CELL), str(path), name=Path(path).stem)


def cell_from_dict(data: Any, where: str | Location, *, name: str = "cell") -> Cell:
    """Returns the cell in a file's `data`.

    Args:
        where: begin of the messages, such as the name of the file.
        name: name of the cell if the data has none.

    Raises:
        MmpError: for a fault, with field and value.
    """
    place = where if isinstance(where, Location) else Location(where)
    decoded = decode(data, CellData, place)
    _refuse_more_than_a_turn(decoded, place)
    return cell_from_data(decoded, place, name=name)


def _refuse_more_than_a_turn(data: CellData, place: Location) -> None:
    """Refuses a yaw above 2 pi in a cell that somebody wrote: it is probably in degrees."""
    for key, items in (("arms", data.arms), ("obstacles", data.obstacles)):
        for k, item in enumerate(items):
            if item.yaw is not None and np.isfinite(item.yaw) and abs(item.yaw) > _ONE_TURN_RAD:
                raise (place / key / k / "yaw").wrong(item.yaw, f"from -6.283 to 6.283 rad{degrees_hint(item.yaw)}")


def cell_from_data(data: CellData, place: Location, *, name: str) -> Cell:
    """Returns the cell in decoded data, see `cell_from_dict`."""
    for key, items, most in (("arms", data.arms, MOST_ARMS), ("obstacles", data.obstacles, MAX_OBSTACLES)):
        if len(items) > most:
            raise MmpError(f"{place / key} has {len(items)} entries; it must have at most {most}")
    if not data.arms:
        raise MmpError(f"{place / 'arms'} is empty; a cell needs at least one arm")
    name = name_or_stem(data.name, name, place / "name")
    carried = read_carried(data.robots, data.tools, place)
    arms = tuple(_arm(arm, carried, place / "arms" / k) for k, arm in enumerate(data.arms))
    obstacles = tuple(solid_from_data(item, place / "obstacles" / k) for k, item in enumerate(data.obstacles))
    spheres = _sphere_set(data.spheres, arms, place / "spheres")
    with named(place):
        joints = _joints(data.joints, arms, place / "joints") if data.joints else None
        cell = Cell(name=name, arms=arms, obstacles=obstacles, spheres=spheres, joints=joints)
    _refuse_overlapping_bases(cell, place)
    return cell


def _sphere_set(given: str | int | None, arms: Sequence[Arm], place: Location) -> str:
    if given is None:
        return finest_geometry(model for arm in arms for model in (arm.robot, arm.tool) if model is not None)
    name = given if isinstance(given, str) else shown(given)
    if name not in GEOMETRIES:
        check_name(name, place)
        raise MmpError(f"{place}: {UnknownNameError('sphere set', name, GEOMETRIES)}")
    return name


def cell_to_dict(cell: Cell) -> dict[str, Any]:
    """Returns the cell as files have it, with tool, sphere set and every pose. Reading it gives the same cell.

    Robots and tools that are not built in are part of it.
    """
    robots, tools = carried_keys(cell.arms)
    carried = {"robots": carried_to_dict(robots), "tools": carried_to_dict(tools)}
    return (
        {
            "name": cell.name,
            "spheres": cell.spheres,
            "arms": [
                {
                    "name": arm.name,
                    "robot": robots.get(arm.robot, arm.robot.name),
                    "tool": tools.get(arm.tool, arm.tool.name) if arm.tool else None,
                    "position": arm.position.tolist(),
                    "quaternion": arm.quaternion.tolist(),
                }
                | ({"held": solid_to_dict(arm.held)} if arm.held else {})
                for arm in cell.arms
            ],
            "obstacles": [solid_to_dict(obstacle) for obstacle in cell.obstacles],
        }
        | {key: models for key, models in carried.items() if models}
        | (_joints_to_dict(cell.joints) if cell.joints else {})
    )


def _joints_to_dict(joints: ModelJoints) -> dict[str, Any]:
    names, addresses = ({arm: list(row) for arm, row in by_arm.items()} for by_arm in (joints.names, joints.addresses))
    return {"joints": {"names": names, "addresses": addresses, "qpos": joints.qpos.tolist()}}


def name_or_stem(name: str | None, stem: str, place: Location) -> str:
    """Returns the name at `place`, or the stem of the file if there is none. Raises `MmpError` for a bad name."""
    if name is not None:
        check_name(name, place)
        return name
    if not is_name(stem):
        raise MmpError(
            f"{place} is missing, and the file's own name {shown(stem)} cannot stand in for it; give {NAMES}"
        )
    return stem


def _arm(data: ArmData, carried: CarriedModels, place: Location) -> Arm:
    check_name(data.name, place / "name")
    robot = _robot(data.robot, carried, place / "robot")
    position, quaternion = pose_from_data(data, place)
    return Arm(
        name=data.name,
        robot=robot,
        tool=_tool(data, robot, carried, place),
        position=position,
        quaternion=quaternion,
        held=_held(data.held, place / "held") if data.held else None,
    )


def _robot(name: str, carried: CarriedModels, place: Location) -> Robot:
    if name in carried.robots:
        return carried.robots[name]
    if is_path(name) and name.isprintable():
        name = str(real_path(Path(place.file).parent / name))  # relative to the cell's file
    else:
        check_name(name, place)
    with named(place):
        return load_robot(name)


def _tool(data: ArmData, robot: Robot, carried: CarriedModels, place: Location) -> Tool | None:
    name = robot.default_tool if data.tool is UNSET else data.tool
    if name is None or name == NO_TOOL:
        if data.tool_state is not None:
            raise MmpError(f"{place / 'tool_state'} is {shown(data.tool_state)}, but the arm has no tool")
        return None
    if name in carried.tools:
        if data.tool_state is not None:
            raise MmpError(
                f"{place / 'tool_state'} is {shown(data.tool_state)}, but the cell carries one state of '{name}'"
            )
        return fitted_tool(carried.tools[name], robot)
    if is_path(name) and name.isprintable():
        name = str(real_path(Path(place.file).parent / name))  # relative to the cell's file
    else:
        check_name(name, place / "tool")
    field = "tool" if data.tool_state is None or find_tool(name) is None else "tool_state"
    with named(place / field):
        return fitted_tool(load_tool(name, data.tool_state), robot)


def _held(data: HeldData, place: Location) -> Obstacle:
    if data.shape == "mesh":
        raise MmpError(f"{place / 'shape'} is 'mesh'; an arm holds a {', '.join(SHAPES[:-2])} or {SHAPES[-2]}")
    return solid_from_data(data, place)


def _joints(data: JointsData, arms: Sequence[Arm], place: Location) -> ModelJoints:
    dofs = {arm.name: arm.dof for arm in arms}
    for key, by_arm in (("names", data.names), ("addresses", data.addresses)):
        if {arm: len(row) for arm, row in by_arm.items()} != dofs:
            raise MmpError(f"{place / key} must have an entry for each joint of each arm of the cell")
    if not all(0 <= k < len(data.qpos) for row in data.addresses.values() for k in row):
        raise MmpError(f"{place / 'addresses'} must be from 0 to {len(data.qpos) - 1}, the numbers of qpos")
    if not np.isfinite(data.qpos).all():
        raise MmpError(f"{place / 'qpos'} holds a number that is not finite")
    return ModelJoints(
        names={arm: tuple(row) for arm, row in data.names.items()},
        addresses={arm: tuple(row) for arm, row in data.addresses.items()},
        qpos=frozen_array(data.qpos),
    )


def _refuse_overlapping_bases(cell: Cell, place: Location) -> None:
    """Raises `MmpError` if the base spheres of two arms intersect. No later query tests two bases."""
    bases = [_base_spheres(arm, cell.spheres) for arm in cell.arms]
    for i, j in combinations(range(len(bases)), 2):
        (centers_i, radii_i), (centers_j, radii_j) = bases[i], bases[j]
        distances = np.linalg.norm(centers_i[:, None] - centers_j[None], axis=-1) - radii_i[:, None] - radii_j[None]
        if np.min(distances, initial=np.inf) < 0:
            (name_a, at_a), (name_b, at_b) = ((cell.arms[k].name, cell.arms[k].position.tolist()) for k in (i, j))
            raise MmpError(
                f"{place / 'arms' / j / 'position'} is {at_b}, where the base of '{name_b}' overlaps "
                f"that of '{name_a}' at {at_a} by {-distances.min() * 1e3:.1f} mm; bases must stand apart"
            )


def _base_spheres(arm: Arm, sphere_set: str) -> tuple[Float[np.ndarray, "s 3"], Float[np.ndarray, "s"]]:
    """Returns centres in the world and radii [m] of the spheres of the base link."""
    spheres = arm.robot.spheres[sphere_set]
    base = spheres.links == 0
    return spheres.centers[base] @ arm.T_world_base[:3, :3].T + arm.T_world_base[:3, 3], spheres.radii[base]
