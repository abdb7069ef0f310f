"""Robots and tools, read from the texts of their files.

Each robot has a folder with `robot.json` (joints, limits, poses), `spheres.json` (its sphere sets) and `<name>.xml`
(MJCF with primitive geoms); plan files carry the same content of robots that are not built in. The checker reads the
kinematics from the MJCF, the planners from `robot.json`; a test compares both.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from mmp_env.argument_checks import text
from mmp_env.errors import MmpError, UnknownNameError, in_words
from mmp_env.model.description import (
    HULLS_FILE,
    ROBOT_FILE,
    SPHERES_FILE,
    TOOL_FILE,
    Description,
    describe_robot,
    describe_tool,
)
from mmp_env.model.hulls import UNKNOWN_PROTRUSION_M, Hull, read_hulls
from mmp_env.model.missing_model import no_such_model
from mmp_env.model.names import is_name
from mmp_env.model.robot import EXACT, Robot, Spheres, Tool, frozen_array
from mmp_env.model.transforms import matrix_from_rpy, transform
from mmp_env.robot_folders import find_robot, find_tool, is_built_in, robot_names, tool_names
from mmp_env.wording import shown

_Model = TypeVar("_Model", Robot, Tool)


def load_robot(name: str) -> Robot:
    """Returns the robot of that name, or in the folder at that path. Raises `UnknownNameError`, `MmpError`."""
    folder = find_robot(text("robot", name))
    if folder is None:
        raise no_such_model("robot", name, robot_names(), ROBOT_FILE)
    return _read_robot(folder, _changed(folder))


def load_tool(name: str, state: str | None = None) -> Tool:
    """Returns the tool of that name, or in the folder at that path.

    Args:
        name: name of the tool, see `tool_names`.
        state: name of one of its states; None for the first.

    Raises:
        UnknownNameError: for an unknown tool or state.
        MmpError: for a state of a tool that has one state without a name, or a fault in a file.
    """
    folder = find_tool(text("tool", name))
    if folder is None:
        raise no_such_model("tool", name, tool_names(), TOOL_FILE)
    states = tool_states(folder)
    if not states:
        if state is not None:
            raise MmpError(f"the state is {shown(state)}, but tool '{folder.name}' has one state, which has no name")
        return _read_tool(folder, folder.name, _changed(folder))
    if state is not None and text("state", state) not in states:
        raise UnknownNameError(f"state of tool '{folder.name}'", state, states)
    part = folder / (state or states[0])
    return _read_tool(part, folder.name, _changed(part))


def tool_states(folder: Path) -> list[str]:
    """Returns the names of the states of the tool in a folder, none if it has one. Raises `MmpError`."""
    try:
        data = json.loads((folder / TOOL_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise MmpError(f"{folder / TOOL_FILE} cannot be read: {in_words(error)}") from None
    states = data.get("states", []) if isinstance(data, dict) else []
    if not isinstance(states, list) or not all(isinstance(state, str) and is_name(state) for state in states):
        raise MmpError(f"{folder / TOOL_FILE}: states is {shown(states)}; it must be a list of names")
    return states


@functools.lru_cache(maxsize=64)
def _read_robot(folder: Path, changed: tuple[int, ...]) -> Robot:
    """The robot in a folder whose files were `changed` at these times."""
    return _from_folder(folder, folder.name, ROBOT_FILE, robot_from_files)


@functools.lru_cache(maxsize=64)
def _read_tool(folder: Path, name: str, changed: tuple[int, ...]) -> Tool:
    return _from_folder(folder, name, TOOL_FILE, tool_from_files)


def _changed(folder: Path) -> tuple[int, ...]:
    """Returns the times [ns] at which the files of a folder were written."""
    try:
        return tuple(path.stat().st_mtime_ns for path in sorted(folder.iterdir()))
    except OSError as error:
        raise MmpError(f"{folder} cannot be read: {in_words(error)}") from None


def _from_folder(folder: Path, name: str, main: str, build: Callable[[str, Mapping[str, str], str], _Model]) -> _Model:
    files = {}
    for file in (main, SPHERES_FILE, HULLS_FILE, f"{name}.xml"):
        try:
            files[file] = (folder / file).read_text(encoding="utf-8")
        except FileNotFoundError:
            continue
        except (OSError, UnicodeDecodeError) as error:
            raise MmpError(f"{folder / file} cannot be read: {in_words(error)}") from None
    model = build(name, files, f"{folder}/")
    return replace(model, files={}) if is_built_in(folder) else model


def robot_from_files(name: str, files: Mapping[str, str], where: str = "") -> Robot:
    """Returns a robot from the texts of its files. It needs no folder, and travels with plans.

    Args:
        name: name of the robot.
        files: file -> text: robot.json, spheres.json, NAME.xml, and optionally hulls.json.
        where: begin of the messages.

    Raises:
        MmpError: for a missing file or a fault in one, with file, field and value.
    """
    described = describe_robot(name, files, where)
    data, links = described.data, tuple(described.data["links"])
    joints = data["joints"]
    exact = _exact_geometry(described, links)
    spheres = {
        key: _spheres({links.index(link): rows for link, rows in by_link.items()})
        for key, by_link in exact.spheres.items()
    }

    def column(key: str) -> np.ndarray:
        return frozen_array([joint[key] for joint in joints])

    rings = data.get("ring_spheres", "28")
    draw = np.array(data.get("draw_limits", [[-np.pi, np.pi]] * len(joints)), dtype=float)

    return Robot(
        name=name,
        title=data["title"],
        joint_names=tuple(joint["name"] for joint in joints),
        link_names=links,
        origins=frozen_array([_pose(joint["origin"]) for joint in joints]),
        axes=column("axis"),
        slides=tuple(joint.get("type") == "slide" for joint in joints),
        lower=column("lower"),
        upper=column("upper"),
        velocity=column("velocity"),
        acceleration=column("acceleration"),
        jerk=column("jerk"),
        effort=column("effort"),
        draw_lower=frozen_array(np.maximum(draw[:, 0], column("lower"))),
        draw_upper=frozen_array(np.minimum(draw[:, 1], column("upper"))),
        acceleration_published=data["acceleration_published"],
        flange=frozen_array(_pose(data["flange"])),
        home=frozen_array(data["home"]),
        tucked=frozen_array(data["tucked"]),
        reach=float(data["reach"]),
        default_tool=data["default_tool"],
        ring_spheres=rings if rings in spheres else "fine",
        ring_height=float(data.get("ring_height", 0.0)),
        spheres=spheres,
        self_ignore={
            key: frozenset((links.index(a), links.index(b)) for a, b in pairs)
            for key, pairs in exact.self_ignore.items()
        },
        mjcf=described.mjcf,
        hulls=exact.hulls,
        protrusion=exact.protrusion,
        files=described.texts,
    )


def tool_from_files(name: str, files: Mapping[str, str], where: str = "") -> Tool:
    """Returns a tool from the texts of tool.json and the other files, see `robot_from_files`."""
    described = describe_tool(name, files, where)
    data, exact = described.data, _exact_geometry(described, [name])
    return Tool(
        name=name,
        mount=frozen_array(_pose(data["mount"])),
        point=frozen_array(data["point"]),
        spheres={key: _spheres({0: rows}) for key, rows in exact.spheres.items()},
        self_ignore={key: frozenset(names) for key, names in exact.self_ignore.items()},
        mjcf=described.mjcf,
        hulls=exact.hulls,
        protrusion=exact.protrusion,
        opening=None if data.get("opening") is None else float(data["opening"]),
        files=described.texts,
    )


class _Geometry(NamedTuple):
    """Geometry in the files of a robot or tool: spheres and ignored pairs by sphere set, and hulls."""

    spheres: dict[str, Any]
    self_ignore: dict[str, Any]
    hulls: tuple[Hull, ...]
    protrusion: float


def _exact_geometry(described: Description, links: Sequence[str]) -> _Geometry:
    """Returns the geometry in a description, with the set `exact` if there are hulls that spheres are proved to cover.

    These are the spheres of that set, or else the set `fine` of a description whose cover was proved.
    """
    data, spheres = described.data, dict(described.spheres)
    ignore = dict(data["self_collision_ignore"])
    hulls = read_hulls(described.hulls or {}, links)
    cover = EXACT if EXACT in spheres else "fine" if data.get("uncovered_mm") == 0.0 else None
    if not hulls or cover is None:
        spheres.pop(EXACT, None)
        return _Geometry(spheres, ignore, (), UNKNOWN_PROTRUSION_M)
    protrusion = data.get("protrusion_mm", {}).get(cover)
    return _Geometry(
        spheres | {EXACT: spheres[cover]},
        ignore | {EXACT: ignore[EXACT if EXACT in ignore else "fine"]},
        hulls,
        UNKNOWN_PROTRUSION_M if protrusion is None else protrusion * 1e-3,
    )


def _pose(data: dict[str, list[float]]) -> np.ndarray:
    return transform(matrix_from_rpy(data["rpy"]), data["xyz"])


def _spheres(by_link: dict[int, list[list[float]]]) -> Spheres:
    rows = [(link, *row) for link in sorted(by_link) for row in by_link[link]]
    return Spheres(
        links=frozen_array([row[0] for row in rows], int),
        centers=frozen_array([row[1:4] for row in rows]),
        radii=frozen_array([row[4] for row in rows]),
    )
