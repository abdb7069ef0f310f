"""Nonsense in cells, by docs/reference/files.md#cells. It shares no code with the readers of the program."""

from __future__ import annotations

import hashlib
import json
import math
import re
import sys
from collections.abc import Iterator
from typing import Any

from fuzz import robot_validator
from fuzz.json_values import is_name, is_number, is_vector, missing, objects, wrong

JOINTS = {"ur5e": 6, "panda": 7, "fr5": 6, "piper": 6}
"""Robot that is built in -> number of its joints."""
TOOLS = ("franka-hand",)
"""Tools that are built in."""
SHAPES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "mesh": (),
}
"""Shape -> its lengths."""
OF_MESHES = ("file", "scale", "pieces")
SPHERES = ("28", "fine", "exact")
MOST_ARMS, MOST_OBSTACLES, MOST_PIECES = 256, 1000, 200
VERTICES = (4, 1000)
"""Least and largest number of vertices of a piece."""
FARTHEST_M = 100.0
LEAST_SIZE_M, MOST_SIZE_M = 1e-6, 100.0
RING = re.compile(r"(?:ring|MultiArmCell)-(\d+)")
"""Name of a built-in cell of UR5e arms -> the number of arms."""


def joints_of(cell: Any) -> dict[str, int | None]:
    """Returns the name of each arm of a cell -> the number of its joints, None where it is in another file."""
    if isinstance(cell, str) and (ring := RING.fullmatch(cell)):
        return {f"arm{k}": JOINTS["ur5e"] for k in range(min(int(ring[1]), MOST_ARMS))}
    arms = objects(cell.get("arms")) if isinstance(cell, dict) else []
    return {str(arm.get("name")): _joints_of_robot(cell, arm.get("robot")) for arm in arms}


def limits_of(cell: Any) -> dict[str, list[tuple[float, float]] | None]:
    """Returns the name of each arm -> lower and upper limit of its joints. Built-in arms turn by 2 pi at most."""
    out: dict[str, list[tuple[float, float]] | None] = {}
    for arm in objects(cell.get("arms")) if isinstance(cell, dict) else []:
        robot = arm.get("robot")
        carried = _carried(cell, "robots", robot).get("robot.json")
        joints = objects(carried.get("joints")) if isinstance(carried, dict) else None
        name = str(arm.get("name"))
        if joints is not None:
            pairs = [(joint.get("lower"), joint.get("upper")) for joint in joints]
            out[name] = [(low, high) for low, high in pairs if is_number(low) and is_number(high)]
        else:
            out[name] = [(-2 * math.pi, 2 * math.pi)] * JOINTS[robot] if robot in JOINTS else None
    return out


def cell_nonsense(cell: Any, most_yaw: float = 4 * math.pi) -> Iterator[str]:
    """Yields what is wrong with a cell, in which a yaw may be so large [rad]."""
    if not isinstance(cell, dict):
        yield "a cell that is no object"
        return
    yield from wrong(cell, "name", is_name(cell.get("name")))
    yield from wrong(cell, "spheres", str(cell.get("spheres")) in SPHERES)
    arms, obstacles = cell.get("arms"), cell.get("obstacles")
    if not isinstance(arms, list) or not 1 <= len(arms) <= MOST_ARMS or len(objects(arms)) < len(arms):
        yield f"arms {str(arms)[:60]}"
    names = [arm.get("name") for arm in objects(arms)]
    for arm in objects(arms):
        yield from _arm_nonsense(arm, cell, most_yaw)
    if obstacles is not None and (not isinstance(obstacles, list) or len(objects(obstacles)) < len(obstacles)):
        yield f"obstacles {str(obstacles)[:60]}"
    elif obstacles is not None and len(obstacles) > MOST_OBSTACLES:
        yield f"{len(obstacles)} obstacles"
    for obstacle in objects(obstacles):
        yield from named_nonsense(obstacle, "an obstacle")
        yield from pose_nonsense(obstacle, most_yaw)
        yield from shape_nonsense(obstacle, names)
    for kind, file, judge in (
        ("robots", "robot.json", robot_validator.robot_nonsense),
        ("tools", "tool.json", robot_validator.tool_nonsense),
    ):
        yield from _carried_nonsense(cell, kind, file, judge)


def named_nonsense(value: dict[str, Any], what: str) -> Iterator[str]:
    """Yields why the name of an arm or an obstacle is none."""
    if not is_name(value.get("name")):
        yield f"{what} named {str(value.get('name'))[:60]!r}"


def pose_nonsense(value: dict[str, Any], most_yaw: float) -> Iterator[str]:
    """Yields what is wrong with the position and the rotation of an arm, an obstacle or an object."""
    if not is_vector(value.get("position"), 3, -FARTHEST_M, FARTHEST_M):
        yield f"position {str(value.get('position'))[:60]}"
    yaw, turn = value.get("yaw"), value.get("quaternion")
    if yaw is not None and turn is not None:
        yield "a yaw and a quaternion"
    yield from wrong(value, "yaw", is_number(yaw, -most_yaw - 1e-9, most_yaw + 1e-9))
    yield from wrong(value, "quaternion", is_vector(turn, 4) and any(turn))


def shape_nonsense(value: dict[str, Any], arms: list[Any]) -> Iterator[str]:
    """Yields what is wrong with the shape of an obstacle, or of an object. `arms` have the names that it may touch."""
    shape = value.get("shape")
    if not isinstance(shape, str) or shape not in SHAPES:
        yield f"shape {str(shape)[:60]}"
        return
    yield from (f"a {shape} without {key}" for key in SHAPES[shape] if value.get(key) is None)
    others = {key for keys in SHAPES.values() for key in keys} - set(SHAPES[shape])
    others |= set() if shape == "mesh" else set(OF_MESHES)
    yield from (f"a {shape} with {key}" for key in sorted(others) if value.get(key) is not None)
    yield from wrong(value, "size", is_vector(value.get("size"), 3, LEAST_SIZE_M, MOST_SIZE_M))
    for key in ("radius", "length"):
        yield from wrong(value, key, is_number(value.get(key), LEAST_SIZE_M, MOST_SIZE_M))
    if shape == "mesh":
        yield from _mesh_nonsense(value)
    yield from wrong(value, "speed", is_number(value.get("speed"), 0.0) and (shape != "mesh" or not value["speed"]))
    touched = value.get("may_touch")
    if touched is not None and not (isinstance(touched, list) and all(_is_part(part, arms) for part in touched)):
        yield f"may_touch {str(touched)[:60]}"


def _mesh_nonsense(value: dict[str, Any]) -> Iterator[str]:
    file, pieces, scale = value.get("file"), value.get("pieces"), value.get("scale")
    if (file is None) == (pieces is None):
        yield "a mesh with both file and pieces, or neither"
    yield from wrong(value, "file", isinstance(file, str))
    is_factor = is_number(scale) and scale != 0
    yield from wrong(value, "scale", is_factor or (is_vector(scale, 3) and all(scale)))
    if pieces is None:
        return
    if not isinstance(pieces, list) or not 1 <= len(pieces) <= MOST_PIECES:
        yield f"pieces {str(pieces)[:60]}"
        return
    for piece in pieces:
        if not isinstance(piece, list) or not VERTICES[0] <= len(piece) <= VERTICES[1]:
            yield f"a piece {str(piece)[:60]}"
        elif not all(is_vector(vertex, 3, -FARTHEST_M, FARTHEST_M) for vertex in piece):
            yield f"vertices {str(piece)[:60]}"


def _is_part(part: Any, arms: list[Any]) -> bool:
    """Returns whether a text names a link, a tool or a held object of a known arm."""
    arm, _, link = part.rpartition("/") if isinstance(part, str) else ("", "", "")
    return arm in arms and bool(link)


def _arm_nonsense(arm: dict[str, Any], cell: dict[str, Any], most_yaw: float) -> Iterator[str]:
    yield from named_nonsense(arm, "an arm")
    yield from pose_nonsense(arm, most_yaw)
    robot, tool = arm.get("robot"), arm.get("tool")
    if not _is_known(cell, "robots", robot, JOINTS):
        yield f"robot {str(robot)[:60]}"
    if tool is not None and not _is_known(cell, "tools", tool, ("none", *TOOLS)):
        yield f"tool {str(tool)[:60]}"
    yield from wrong(arm, "tool_state", isinstance(arm.get("tool_state"), str))
    held = arm.get("held")
    if held is not None and not isinstance(held, dict):
        yield f"held {str(held)[:60]}"
    elif held is not None:
        yield from pose_nonsense(held, most_yaw)
        yield from shape_nonsense(held, [])
        if held.get("shape") == "mesh":
            yield "a mesh that is held"


def _is_known(cell: dict[str, Any], kind: str, name: Any, built_in: Any) -> bool:
    """Returns whether a robot or a tool is built in, is carried, or is a folder."""
    return isinstance(name, str) and (name in built_in or "/" in name or bool(_carried(cell, kind, name)))


def _carried(cell: dict[str, Any], kind: str, name: Any) -> dict[str, Any]:
    """Returns the files of a robot or of a tool that a cell carries."""
    carried = cell.get(kind)
    files = carried.get(name) if isinstance(carried, dict) and isinstance(name, str) else None
    return files if isinstance(files, dict) else {}


def _joints_of_robot(cell: dict[str, Any], robot: Any) -> int | None:
    carried = _carried(cell, "robots", robot).get("robot.json")
    joints = carried.get("joints") if isinstance(carried, dict) else None
    built_in = JOINTS.get(robot) if isinstance(robot, str) else None
    return len(joints) if isinstance(joints, list) else built_in


def _digest(files: dict[str, Any]) -> str:
    """Returns the hash of the files of a robot or of a tool that a cell carries, by docs/reference/files.md."""
    text = json.dumps(_floats({key: value for key, value in files.items() if key != "sha256"}), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _floats(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _floats(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_floats(item) for item in value]
    if not isinstance(value, int | float) or isinstance(value, bool):
        return value
    if abs(value) > sys.float_info.max:
        return math.inf if value > 0 else -math.inf
    return float(value) + 0.0


def _carried_nonsense(cell: dict[str, Any], kind: str, file: str, judge: Any) -> Iterator[str]:
    carried = cell.get(kind)
    yield from wrong(cell, kind, isinstance(carried, dict))
    for name, files in carried.items() if isinstance(carried, dict) else ():
        if kind == "robots" and name in JOINTS:
            yield f"a carried robot named {name}"
        if not isinstance(files, dict):
            yield f"files {str(files)[:60]}"
            continue
        if files.get("sha256") is not None and files["sha256"] != _digest(files):
            yield f"carried {name}, changed since its sha256 was written"
        yield from missing(files, file, "spheres.json")
        if file in files:
            yield from judge(files[file])
        yield from robot_validator.spheres_nonsense(files.get("spheres.json", {}), are_by_link=kind == "robots")
        yield from robot_validator.hulls_nonsense(files.get("hulls.json", {}))
