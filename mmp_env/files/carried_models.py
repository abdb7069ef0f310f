"""Robots and tools that are not built in, carried by the cells that use them.

The JSON form of a cell has them under `robots` and `tools`: key -> file -> content. The arms of the cell call the robot
or tool by its key. JSON files are objects, and the MJCF, whose file is `NAME.xml`, is text.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from mmp_env.errors import MmpError
from mmp_env.files.reading import Location
from mmp_env.model.arm import Arm
from mmp_env.model.names import NAMES, is_name
from mmp_env.model.robot import Robot, Tool
from mmp_env.model.robot_reading import robot_from_files, tool_from_files
from mmp_env.robot_folders import is_built_in_robot, is_built_in_tool

NO_TOOL = "none"
"""Name that stands for a bare flange in files."""
MOST_CARRIED = 64
"""Largest numbers of robots and of tools that a cell carries."""
_MJCF = ".xml"
_HASH = "sha256"
"""Entry beside the files of a robot or tool, which shows a later change of them."""
_Model = TypeVar("_Model", Robot, Tool)


@dataclass(frozen=True, kw_only=True, eq=False)
class CarriedModels:
    """Robots and tools by key."""

    robots: Mapping[str, Robot]
    tools: Mapping[str, Tool]


def read_carried(robots: Mapping[str, Any], tools: Mapping[str, Any], place: Location) -> CarriedModels:
    """Returns the robots and tools that a cell carries, and reads no other file.

    Raises:
        MmpError: for the name of a built-in robot or tool, or a fault in a file, with file, field and value.
    """
    return CarriedModels(
        robots=_read(robots, place / "robots", is_built_in_robot, robot_from_files, _robot_parts),
        tools=_read(tools, place / "tools", is_built_in_tool, tool_from_files, _tool_parts),
    )


def carried_keys(arms: Iterable[Arm]) -> tuple[dict[Robot, str], dict[Tool, str]]:
    """Returns the key of each robot and each tool of these arms that is not built in.

    Two that have the same name and other content have different keys; those of the same content have one key.
    """
    arms = list(arms)
    robots = _keys((arm.robot for arm in arms), is_built_in_robot)
    tools = _keys((arm.tool for arm in arms if arm.tool), lambda name: name == NO_TOOL or is_built_in_tool(name))
    return robots, tools


def carried_to_dict(keys: Mapping[_Model, str]) -> dict[str, dict[str, Any]]:
    """Returns key -> file -> content of robots or tools, each with the hash of its files."""
    out = {}
    for model, key in keys.items():
        files = {file: json.loads(text) for file, text in sorted(model.files.items())}
        files[model.name + _MJCF] = model.mjcf
        out[key] = files | {_HASH: _hash(files)}
    return out


def _without_hash(files: Mapping[str, Any]) -> dict[str, Any]:
    return {file: content for file, content in files.items() if file != _HASH}


def _hash(files: Mapping[str, Any]) -> str:
    """Returns the SHA-256 of JSON text with sorted keys, in which every number is a float, and none is -0.0."""
    content = json.loads(json.dumps(files), parse_int=_number, parse_float=_number)
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _number(text: str) -> float:
    return float(text) + 0.0  # which is 0.0 for -0.0


def _read(
    data: Mapping[str, Any],
    place: Location,
    is_built_in: Callable[[str], bool],
    build: Callable[[str, Mapping[str, str], str], _Model],
    parts: Callable[[_Model], tuple[list[str], int]],
) -> dict[str, _Model]:
    if len(data) > MOST_CARRIED:
        raise MmpError(f"{place} has {len(data)} entries; it must have at most {MOST_CARRIED}")
    out = {}
    for key, files in data.items():
        if not is_name(key) or key == NO_TOOL:
            raise MmpError(f"{place} has the name {key!r}; it must be {NAMES}, and not '{NO_TOOL}'")
        if is_built_in(key):
            raise MmpError(f"{place / key} has the name of one that is built in; choose another name")
        out[key] = _model(files, place / key, build)
        _compile(out[key], parts, f"{place / key}: {out[key].name}{_MJCF}")
        stated = files.get(_HASH)
        if stated is not None and stated != _hash(_without_hash(files)):
            raise MmpError(
                f"{place / key} was changed after the file was written; leave out its '{_HASH}' to use the change"
            )
    return out


def _model(files: Any, place: Location, build: Callable[[str, Mapping[str, str], str], _Model]) -> _Model:
    if not isinstance(files, dict):
        raise place.wrong(files, "an object of file -> content")
    files = _without_hash(files)
    names = [file.removesuffix(_MJCF) for file in files if file.endswith(_MJCF)]
    if len(names) != 1 or not is_name(names[0]):
        raise MmpError(f"{place} has {len(names)} files NAME{_MJCF}; it must have one, whose NAME is {NAMES}")
    # Numbers such as NaN stay, so that the reader of the texts names their fields.
    texts = {file: value if file.endswith(_MJCF) else json.dumps(value) for file, value in files.items()}
    return build(names[0], texts, f"{place}: ")


def _keys(models: Iterable[_Model], is_taken: Callable[[str], bool]) -> dict[_Model, str]:
    foreign = list(dict.fromkeys(model for model in models if model.files))
    names = {model.name for model in foreign}
    out: dict[_Model, str] = {}
    for model in foreign:
        same = next((key for other, key in out.items() if _same(other, model)), None)
        out[model] = same or _free_key(model.name, {*out.values()}, names, is_taken)
    return out


def _free_key(name: str, used: set[str], names: set[str], is_taken: Callable[[str], bool]) -> str:
    key, number = name, 1
    while key in used or is_taken(key) or (number > 1 and key in names):
        number += 1
        key = f"{name[:80]}-{number}"
    return key


def _same(a: _Model, b: _Model) -> bool:
    if (a.name, a.mjcf, a.files.keys()) != (b.name, b.mjcf, b.files.keys()):
        return False
    return all(text == b.files[file] or json.loads(text) == json.loads(b.files[file]) for file, text in a.files.items())


def _robot_parts(robot: Robot) -> tuple[list[str], int]:
    """Returns the bodies and the number of joints that the MJCF of a robot must have."""
    return list(robot.link_names), robot.dof


def _tool_parts(tool: Tool) -> tuple[list[str], int]:
    return [tool.name], 0


def _compile(model: _Model, parts: Callable[[_Model], tuple[list[str], int]], where: str) -> None:
    """Raises `MmpError` for MJCF that MuJoCo refuses, or whose parts are not those of the robot or tool."""
    from mmp_env.mujoco_import import mujoco, without_log, without_report

    try:
        with without_log(), without_report(beside_threads=False):
            compiled = mujoco.MjModel.from_xml_string(model.mjcf)
    except ValueError as error:
        raise MmpError(f"{where} is not MJCF that MuJoCo can read: {' '.join(str(error).split())}") from None
    bodies, joints = parts(model)
    numbers = range(1, joints + 1)
    found = {compiled.body(k).name for k in range(1, compiled.nbody)}
    for body in bodies:
        if body not in found:
            raise MmpError(f"{where} has no body '{body}'")
    for kind, found, wanted in (
        ("joints", [compiled.joint(k).name for k in range(compiled.njnt)], [f"joint{k}" for k in numbers]),
        ("actuators", [compiled.actuator(k).name for k in range(compiled.nu)], [f"servo{k}" for k in numbers]),
    ):
        if found != wanted:
            raise MmpError(
                f"{where} has the {kind} {', '.join(found) or 'none'}; it must have {', '.join(wanted) or 'none'}"
            )
    if mujoco.mj_name2id(compiled, mujoco.mjtObj.mjOBJ_SITE, site := "flange" if joints else "tool_point") < 0:
        raise MmpError(f"{where} has no site '{site}'")
