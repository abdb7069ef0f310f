"""Robots and tools for the checker: those that the cell of a plan carries, built-in ones, and those in folders."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.fields import LARGEST_M, UnreadableError, known, listed, member, numbers, positive, shown, text
from mmp_env.check.mjcf import refuse_mjcf
from mmp_env.errors import HOW_TO_ADD
from mmp_env.robot_folders import find_robot, find_tool, robot_names, tool_names

DATA = Path(__file__).parent.parent
_MAIN = {"robots": "robot.json", "tools": "tool.json"}
_SPHERES, _HULLS, _MJCF = "spheres.json", "hulls.json", ".xml"
_HASH = "sha256"
"""Entry beside the files of a carried robot or tool: the hash of their content."""
_ORIGIN = "origin"
"""Field of hulls.json that says where the hulls are from."""
_MOST_JOINTS, _MOST_MODELS = 64, 64
_FIELDS = {
    "robots": (
        *("title", "reach", "links", "joints", "flange", "home", "tucked", "draw_limits", "default_tool"),
        *("ring_spheres", "ring_height", "acceleration_published", "approximate_sets_mm", "protrusion_mm"),
        *("uncovered_mm", "self_collision_ignore", "self_pairs_ignored", "self_pairs_tested", "hull_volumes_m3"),
        *("imported", "fingerprints", "sources", "notes"),
    ),
    "tools": (
        *("title", "mount", "point", "opening", "mass", "state", "joint_values", "protrusion_mm", "uncovered_mm"),
        *("self_collision_ignore", "self_pairs", "imported", "sources", "notes"),
    ),
}
"""Kind -> known fields of robot.json or tool.json."""
_INNER_FIELDS = {
    "imported": ("source", "sha256", "importer", "root", "tip", "held"),
    "flange": ("xyz", "rpy"),
    "mount": ("xyz", "rpy"),
    "self_collision_ignore": ("28", "fine", "exact"),
}
"""Field of robot.json or tool.json -> its known fields."""
_JOINT_FIELDS = ("name", "type", "origin", "axis", "lower", "upper", "velocity", "acceleration", "jerk", "effort")


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedModel:
    """A robot or tool: its name, the content of robot.json or tool.json, of spheres.json and hulls.json, and MJCF."""

    name: str
    data: Mapping[str, Any]
    spheres: Mapping[str, Any]
    hulls: Mapping[str, Any] | None
    mjcf: str

    @property
    def content(self) -> tuple[Any, ...]:
        """All that makes two models the same."""
        return self.name, self.data, self.spheres, self.hulls, self.mjcf

    @property
    def links(self) -> list[str]:
        """Names of the links; of a tool its name."""
        return self.data.get("links", [self.name])

    @property
    def has_exact_geometry(self) -> bool:
        """Whether there are hulls that spheres are said to cover."""
        return bool(self.hulls) and ("exact" in self.spheres or self.data.get("uncovered_mm") == 0.0)

    def sphere_set(self, key: str) -> dict[str, Float[np.ndarray, "s 4"]]:
        """Returns centres and radii [m] of a sphere set by link. Raises `UnreadableError`."""
        where = f"{_SPHERES} of '{self.name}'"
        rows = member(self.spheres, key, where)
        by_link = rows if isinstance(rows, Mapping) else {self.name: rows}
        out = {}
        for link, table in by_link.items():
            if link not in self.links:
                raise UnreadableError(f"{where} names {shown(link)}, which is not a link")
            if table != []:
                out[link] = _lengths(table, (None, 4), f"set {key} of '{link}' in {where}")
                if not (out[link][:, 3] > 0).all():
                    raise UnreadableError(f"set {key} of '{link}' in {where} has a radius that is not above zero")
        if not out:
            raise UnreadableError(f"set {key} in {where} has no spheres")
        return out

    def link_hulls(self) -> dict[str, list[tuple[Float[np.ndarray, "v 3"], float]]]:
        """Returns vertices and radii [m] of the hulls by link. Raises `UnreadableError`."""
        if self.hulls is None:
            raise UnreadableError(f"'{self.name}' has no {_HULLS}")
        where, out = f"{_HULLS} of '{self.name}'", {}
        for link, pieces in self.hulls.items():
            if link not in self.links:
                if link == _ORIGIN:
                    continue
                raise UnreadableError(f"{where} names {shown(link)}, which is not a link")
            out[link] = []
            for piece in listed({link: pieces}, link, where):
                vertices = _lengths(member(piece, "vertices", f"a hull of '{link}'"), (None, 3), f"a hull of '{link}'")
                radius = float(_lengths(member(piece, "radius", f"a hull of '{link}'"), (), f"a radius of '{link}'"))
                if not len(vertices) or radius < 0:
                    raise UnreadableError(f"a hull of '{link}' in {where} has no vertex or a radius below zero")
                out[link].append((vertices, radius))
        if not any(out.values()):
            raise UnreadableError(f"{where} has no hulls")
        return out


@dataclass(frozen=True, kw_only=True, eq=False)
class CarriedModels:
    """Robots and tools that a cell carries. They come before those in folders."""

    robots: Mapping[str, CheckedModel]
    tools: Mapping[str, CheckedModel]

    @classmethod
    def read(cls, robots: Any, tools: Any) -> CarriedModels:
        """Returns the models in `robots` and `tools` of a cell; both may be None. Raises `UnreadableError`."""
        return cls(robots=_carried(robots, "robots"), tools=_carried(tools, "tools"))

    def robot(self, key: str) -> CheckedModel:
        """Returns a robot. Raises `UnreadableError` if there is none of that name."""
        return self.robots.get(key) or _found("robots", key)

    def tool(self, key: str) -> CheckedModel:
        """Returns a tool. Raises `UnreadableError` if there is none of that name."""
        return self.tools.get(key) or _found("tools", key)


def _carried(data: Any, kind: str) -> dict[str, CheckedModel]:
    if data is None:
        return {}
    if not isinstance(data, Mapping) or len(data) > _MOST_MODELS:
        raise UnreadableError(f"{kind} of the cell is not an object of at most {_MOST_MODELS} entries")
    out = {}
    for key, files in data.items():
        where = f"'{key}' among the {kind} of the cell"
        if "/" in key or (DATA / kind / key / _MAIN[kind]).is_file():
            raise UnreadableError(f"{where} has the name of one that is built in, or a slash in its name")
        names = [file for file in files if file.endswith(_MJCF)] if isinstance(files, Mapping) else []
        if len(names) != 1:
            raise UnreadableError(f"{where} does not have one file NAME{_MJCF}")
        known(files, (_MAIN[kind], _SPHERES, _HULLS, names[0], _HASH), where)
        out[key] = _model(names[0].removesuffix(_MJCF), kind, files, where)
        stated = files.get(_HASH)
        if stated is not None and stated != _hash({name: files[name] for name in files if name != _HASH}, where):
            raise UnreadableError(f"{where} was changed after the file was written: its {_HASH} is of other content")
    return out


def _hash(files: Mapping[str, Any], where: str) -> str:
    """Returns the SHA-256 of JSON text with sorted keys, in which every number is a float, and none is -0.0.

    Raises:
        UnreadableError: for a value that JSON does not have.
    """
    try:
        text = json.dumps(files, default=lambda array: array.tolist())
    except (TypeError, ValueError, AttributeError, RecursionError):
        raise UnreadableError(f"{where} holds a value that JSON does not have") from None
    text = json.dumps(json.loads(text, parse_int=_plain, parse_float=_plain), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(number: str) -> float:
    return float(number) + 0.0  # which is 0.0 for -0.0


def _model(name: str, kind: str, files: Mapping[str, Any], where: str) -> CheckedModel:
    data = member(files, _MAIN[kind], where)
    known(data, _FIELDS[kind], f"{_MAIN[kind]} of {where}")
    for key, fields in _INNER_FIELDS.items():
        if key in data:
            known(data[key], fields, f"{key} of {where}")
    ignored = member(data, "self_collision_ignore", f"{_MAIN[kind]} of {where}")
    if not isinstance(ignored, Mapping):
        raise UnreadableError(f"self_collision_ignore of {where} is not a JSON object")
    for key in ignored:
        entries = listed(ignored, key, f"self_collision_ignore of {where}")
        if kind == "robots":
            entries = [link for pair in entries for link in (pair if isinstance(pair, list) else [None])]
        if not all(isinstance(link, str) for link in entries):
            raise UnreadableError(f"self_collision_ignore of {where} does not hold names of links only")
    if kind == "robots":
        _test_robot(data, f"robot.json of {where}")
    mjcf = text(files, f"{name}{_MJCF}", where)
    refuse_mjcf(mjcf, f"{name}{_MJCF} of {where}")
    hulls = files.get(_HULLS)
    for part, value in ((_SPHERES, member(files, _SPHERES, where)), (_HULLS, {} if hulls is None else hulls)):
        if not isinstance(value, Mapping):
            raise UnreadableError(f"{part} of {where} is not a JSON object")
    known(files[_SPHERES], _INNER_FIELDS["self_collision_ignore"], f"{_SPHERES} of {where}")
    for link in {} if hulls is None else hulls.keys() - {_ORIGIN}:
        for piece in listed(hulls, link, f"{_HULLS} of {where}"):
            known(piece, ("vertices", "radius"), f"a hull of '{link}' in {_HULLS} of {where}")
    return CheckedModel(name=name, data=data, spheres=files[_SPHERES], hulls=hulls, mjcf=mjcf)


def _test_robot(data: Any, where: str) -> None:
    """Tests the fields of robot.json that the checker uses."""
    links, joints = listed(data, "links", where), listed(data, "joints", where)
    if not all(isinstance(link, str) for link in links) or len(set(links)) < len(links):
        raise UnreadableError(f"links of {where} are not different names")
    if not 1 <= len(joints) <= _MOST_JOINTS or len(links) != len(joints) + 1:
        raise UnreadableError(f"{where} does not have 1 to {_MOST_JOINTS} joints and one link more")
    for k, joint in enumerate(joints):
        known(joint, _JOINT_FIELDS, f"joint {k} of {where}")
        known(joint.get("origin", {}), ("xyz", "rpy"), f"origin of joint {k} of {where}")
        lower, upper = (_finite(member(joint, key, f"joint {k} of {where}"), (), key) for key in ("lower", "upper"))
        if not lower < upper:
            raise UnreadableError(f"joint {k} of {where} has no upper limit above its lower limit")
        for key in ("velocity", "acceleration", "jerk"):
            positive(member(joint, key, f"joint {k} of {where}"), f"{key} of joint {k} of {where}")
    if not isinstance(member(data, "default_tool", where), str | None):
        raise UnreadableError(f"default_tool of {where} is not a string")


def _finite(value: Any, shape: tuple[int | None, ...], where: str) -> Float[np.ndarray, "..."]:
    array = numbers(value, shape, where)
    if not np.isfinite(array).all():
        raise UnreadableError(f"{where} has a number that is not finite")
    return array


def _lengths(value: Any, shape: tuple[int | None, ...], where: str) -> Float[np.ndarray, "..."]:
    array = _finite(value, shape, where)
    if not (np.abs(array) <= LARGEST_M).all():
        raise UnreadableError(f"{where} has a number beyond {LARGEST_M:g} m")
    return array


def _found(kind: str, name: str) -> CheckedModel:
    """Returns a built-in model, or one in a folder."""
    find, names, advice = (
        (find_robot, robot_names, HOW_TO_ADD["robot"])
        if kind == "robots"
        else (find_tool, tool_names, HOW_TO_ADD["tool"])
    )
    folder = find(name)
    if folder is None:
        raise UnreadableError(f"'{name}' is not among the {kind}: {', '.join(names())}. {advice}")
    try:
        return _in_folder(folder, kind, tuple(path.stat().st_mtime_ns for path in sorted(folder.iterdir())))
    except (OSError, ValueError, RecursionError) as error:
        raise UnreadableError(f"'{name}' among the {kind} cannot be read: {error}") from None


@functools.lru_cache(maxsize=64)
def _in_folder(folder: Path, kind: str, changed: tuple[int, ...]) -> CheckedModel:
    """The model in a folder whose files were `changed` at these times."""
    files = {
        file: json.loads((folder / file).read_text(encoding="utf-8"))
        for file in (_MAIN[kind], _SPHERES, _HULLS)
        if (folder / file).is_file()
    }
    mjcf = f"{folder.name}{_MJCF}"
    files[mjcf] = (folder / mjcf).read_text(encoding="utf-8")
    return _model(folder.name, kind, files, f"'{folder.name}'")
