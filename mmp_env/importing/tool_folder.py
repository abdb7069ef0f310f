"""Imports a gripper into a tool folder, whole or not at all: its collision geometry in one or several named states.

A tool of one state is a folder of tool.json, spheres.json, hulls.json and MJCF. A tool of several states has a
tool.json that lists them, and such a folder for each.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.paths import exists
from mmp_env.files.writing import json_text
from mmp_env.importing.chain import Chain
from mmp_env.importing.chain_links import Link, colliding, link_of_bodies
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.cover_fit import FINE_M, Cover, CoverError, coarse_covers, fit_cover
from mmp_env.importing.folder_writing import read_folder, write_folder
from mmp_env.importing.link_pieces import pieces_and_notes
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.mjcf_text import tool_mjcf
from mmp_env.importing.pieces import Piece
from mmp_env.importing.source import prepare_source
from mmp_env.importing.target_folder import Imported, TargetFolder
from mmp_env.importing.tool_joints import place_joints
from mmp_env.mujoco_import import mujoco
from mmp_env.robot_folders import TOOL_DESCRIPTION

VERSION = 5
"""Version of the importer's results. The cache holds results of the same version only."""
COARSE_SPHERES = 8
"""Number of spheres that a tool has in set `28`."""
POINT_NAMES = ("tool_point", "grip_site", "grasp_site", "pinch", "tcp", "tool_center_point", "ee")
"""Names of sites and bodies that are taken as the tool point, the first that exists."""

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class ToolOptions:
    """Options of an import.

    Attributes:
        name: name of the tool and of its folder.
        states: name of a state -> values of joints, as `joint=value,...` or `value,...`; empty for one state.
        point: site or body whose origin is the tool point, or None.
        package_dirs: folders in which packages of `package://` paths are looked for.
    """

    name: str
    states: Mapping[str, str]
    point: str | None = None
    package_dirs: tuple[str, ...] = ()


def add_tool(
    source: str | Path, out: str | Path, options: ToolOptions, *, cache: str | Path | None, progress: Progress
) -> Imported:
    """Imports the gripper in a URDF or MJCF file into the folder `out`/name.

    Args:
        source: the file. Its world is the frame of the flange.
        out: folder that gets the tool's folder.
        options: name, states and tool point.
        cache: folder of earlier results, or None.
        progress: called with a line for each step.

    Raises:
        MmpError: if the source cannot be imported or the folder may not or cannot be written. Then nothing is written.
    """
    prepared = prepare_source(source, options.package_dirs)
    place = TargetFolder(out=Path(out), name=options.name, kind="tool", description=TOOL_DESCRIPTION)
    place.checked(prepared.inputs)
    said = json.dumps([VERSION, prepared.digest, prepared.path.name, asdict(replace(options, package_dirs=()))])
    kept = Path(cache) / hashlib.sha256(said.encode()).hexdigest()[:40] if cache is not None else None
    from_cache = kept is not None and exists(kept / TOOL_DESCRIPTION)
    files = read_folder(kept) if kept and from_cache else tool_files(prepared.compiled(), options, progress)
    if kept is not None and not from_cache:
        write_folder(kept, files)
    target = place.checked(prepared.inputs)  # an import takes long enough for the folder to change
    replaced = exists(target)
    write_folder(target, files)
    return Imported(folder=target, from_cache=from_cache, replaced=replaced)


def tool_files(source: SourceModel, options: ToolOptions, progress: Progress) -> dict[str, str]:
    """Returns the content of the tool's files by path. Raises `MmpError`."""
    if not options.states:
        return _state_files(source, options, None, progress)
    out = {}
    for state in options.states:
        files = _state_files(source, options, state, progress)
        out |= {f"{state}/{file}": text for file, text in files.items()}
    return {TOOL_DESCRIPTION: json_text({"title": _title(source), "states": list(options.states)}), **out}


def summary(folder: Path) -> dict[str, Any]:
    """Returns what a tool folder holds, in numbers, as `--json` prints it."""
    top = json.loads((folder / TOOL_DESCRIPTION).read_text(encoding="utf-8"))
    parts = {state: folder / state for state in top["states"]} if "states" in top else {"default": folder}
    states = {}
    for state, part in parts.items():
        tool = json.loads((part / TOOL_DESCRIPTION).read_text(encoding="utf-8"))
        spheres = json.loads((part / "spheres.json").read_text(encoding="utf-8"))
        states[state] = {
            "joints": tool["joint_values"],
            "point": tool["point"],
            "spheres": {key: len(rows) for key, rows in spheres.items()},
            "protrusion_mm": tool["protrusion_mm"],
            "uncovered_mm": tool["uncovered_mm"],
            "notes": tool["notes"],
        }
    return {"name": folder.name, "title": top["title"], "states": states, "folder": str(folder)}


def _state_files(source: SourceModel, options: ToolOptions, state: str | None, progress: Progress) -> dict[str, str]:
    label = f"state {state}" if state else options.name
    data, joints = _placed(source, "" if state is None else options.states[state], label)
    link = _link(source, data, options.name)
    pieces, notes = _pieces(source, data, link)
    progress(f"{label}: {len(pieces)} convex pieces")
    shape = LinkShape(pieces)
    try:
        coarse = coarse_covers([None, shape], COARSE_SPHERES)[1]
        covers = {"28": coarse, "fine": fit_cover(shape, FINE_M)}
    except CoverError as error:
        raise MmpError(f"{source.path}: no sphere cover was found: {error}") from None
    point = _point(source, data, options.point, pieces)
    progress(f"{label}: {len(_cover(covers['fine']).radii)} spheres, cover proved")
    tool = {
        "title": _title(source) + (f", {state}" if state else ""),
        "mount": {"xyz": [0.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0]},
        "point": point.tolist(),
        "mass": link.mass,
        "joint_values": joints,
        "protrusion_mm": {key: round(_cover(cover).protrusion * 1e3, 4) for key, cover in covers.items()},
        "uncovered_mm": 0.0,
        "self_collision_ignore": {key: [] for key in covers},
        "self_pairs": "by robot",
        "imported": {"source": source.path.name, "sha256": source.digest, "importer": VERSION},
        "notes": [*source.notes, *notes],
    }
    hulls = {options.name: [{"vertices": p.vertices.tolist(), "radius": p.radius} for p in pieces]}
    return {
        TOOL_DESCRIPTION: json_text(tool | ({"state": state} if state else {})),
        "spheres.json": json_text({key: _rows(_cover(cover)) for key, cover in covers.items()}),
        "hulls.json": json_text(hulls),
        f"{options.name}.xml": tool_mjcf(options.name, link, pieces, point),
    }


def _title(source: SourceModel) -> str:
    return f"{source.title}, imported from {source.path.name}"


def _cover(cover: Cover | None) -> Cover:
    assert cover is not None
    return cover


def _rows(cover: Cover) -> list[list[float]]:
    return [[*center, radius] for center, radius in zip(cover.centers.tolist(), cover.radii.tolist(), strict=True)]


def _placed(source: SourceModel, values: str, label: str) -> tuple[Any, dict[str, float]]:
    """Returns the model in a state, and the values of its joints [rad or m]."""
    model = source.model
    names = [model.joint(k).name or f"joint{k + 1}" for k in range(model.njnt)]
    if not set(model.jnt_type.tolist()) <= {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}:
        raise MmpError(f"{source.path} has a ball or free joint; a tool has hinges and slides only")
    data = mujoco.MjData(model)
    given = _joint_values(values, names, label)
    place_joints(source, data, {names.index(name): value for name, value in given.items()}, label)
    for k, name in enumerate(names):
        value, (low, high) = data.qpos[model.jnt_qposadr[k]], model.jnt_range[k]
        placed = name in given or value != model.qpos0[model.jnt_qposadr[k]]
        if placed and model.jnt_limited[k] and not low - 1e-9 <= value <= high + 1e-9:
            raise MmpError(f"{label}: joint '{name}' is {value:g}; its limits are {low:g} to {high:g}")
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data, {name: float(data.qpos[model.jnt_qposadr[k]]) for k, name in enumerate(names)}


def _joint_values(text: str, names: list[str], label: str) -> dict[str, float]:
    """Returns joint -> value of `joint=value,...`, or of one value for each joint in order."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    named = [part.rpartition("=") for part in parts]
    if parts and not any(equals for _, equals, _ in named):
        if len(parts) != len(names):
            raise MmpError(f"{label} has {len(parts)} values; the tool has {len(names)} joints: {', '.join(names)}")
        named = [(name, "=", part) for name, part in zip(names, parts, strict=True)]
    out = {}
    for name, equals, value in named:
        if not equals:
            raise MmpError(f"{label}: '{value}' names no joint; give JOINT=VALUE,... or one value for each joint")
        if name not in names:
            raise UnknownNameError(f"joint of {label}", name, names)
        if name in out:
            raise MmpError(f"{label}: joint '{name}' is given twice; give it one value")
        try:
            out[name] = float(value)
        except ValueError:
            out[name] = float("nan")
        if not np.isfinite(out[name]):
            raise MmpError(f"{label}: joint '{name}' is '{value}'; it must be a finite number [rad or m]")
    return out


def _link(source: SourceModel, data: Any, name: str) -> Link:
    solid, bodies = colliding(source.model), tuple(range(source.model.nbody))
    link = link_of_bodies(source.model, data, name, bodies, np.eye(4), np.eye(4), solid)
    if not len(link.geoms):
        raise MmpError(f"{source.path} has no collision geometry: every geom has contype and conaffinity 0")
    return link


def _pieces(source: SourceModel, data: Any, link: Link) -> tuple[tuple[Piece, ...], list[str]]:
    world = np.eye(4)
    alone = Chain(
        source=source,
        data=data,
        base=world,
        root="world",
        tip=link.name,
        joints=(),
        joint_names=(),
        links=(link,),
        held=(),
        flange=world,
    )
    return pieces_and_notes(alone, link)


def _point(source: SourceModel, data: Any, asked: str | None, pieces: tuple[Piece, ...]) -> np.ndarray:
    """Returns the tool point: of the site or body asked for, of one with a usual name, or the outermost point on z."""
    model = source.model
    places = {model.body(k).name: data.xpos[k] for k in range(1, model.nbody)}
    places |= {model.site(k).name: data.site_xpos[k] for k in range(model.nsite)}
    if asked is not None and asked not in places:
        raise UnknownNameError("site or body", asked, [name for name in places if name])
    name = asked or next((name for name in POINT_NAMES if name in places), None)
    if name is not None:
        return np.round(places[name], 9) + 0.0
    return np.array([0.0, 0.0, max(float(p.vertices[:, 2].max()) + p.radius for p in pieces)])
