"""Descriptions of robots and tools: the content of their files, tested field by field.

`robot.json` or `tool.json` holds the numbers, `spheres.json` the sphere sets, `hulls.json` (optional) convex hulls, and
`NAME.xml` the MJCF. docs/reference/robots.md describes them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mmp_env.argument_checks import require_finite
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.mjcf import refuse_mjcf
from mmp_env.model.names import NAMES, is_name
from mmp_env.wording import shown

ROBOT_FILE, TOOL_FILE, SPHERES_FILE, HULLS_FILE = "robot.json", "tool.json", "spheres.json", "hulls.json"
MOST_JOINTS = 64
"""Largest number of joints of a robot."""
_MOST_SPHERES, _MOST_HULLS, _MOST_VERTICES = 20_000, 5000, 200_000
"""Largest numbers of spheres in a set, of hulls, and of their vertices."""
_LARGEST_M, _LARGEST = 100.0, 1e9
"""Largest coordinate [m], and largest number of any unit."""
_LONGEST_TEXT = 1000
_ROBOT_FIELDS = (
    *("title", "reach", "links", "joints", "flange", "home", "tucked", "draw_limits", "default_tool", "ring_spheres"),
    *("ring_height", "acceleration_published", "approximate_sets_mm", "protrusion_mm", "uncovered_mm"),
    *("self_collision_ignore", "self_pairs_ignored", "self_pairs_tested", "hull_volumes_m3", "imported"),
    *("fingerprints", "sources", "notes"),
)
_TOOL_FIELDS = (
    *("title", "mount", "point", "opening", "mass", "state", "joint_values", "protrusion_mm", "uncovered_mm"),
    *("self_collision_ignore", "self_pairs", "imported", "sources", "notes"),
)
_IMPORT_FIELDS = ("source", "sha256", "importer", "root", "tip", "held")
_JOINT_FIELDS = ("name", "type", "origin", "axis", "lower", "upper", "velocity", "acceleration", "jerk", "effort")
_PAIR_FIELDS = ("a", "b", "reason", "sphere_set")
_REQUIRED_SETS = ("28", "fine")
_SETS = (*_REQUIRED_SETS, "exact")
_ORIGIN = "origin"
"""Field of hulls.json that says where the hulls are from."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Description:
    """Content of the files of a robot or tool.

    Attributes:
        name: name of the robot or tool.
        data: content of robot.json or tool.json.
        spheres: content of spheres.json.
        hulls: content of hulls.json, or None.
        mjcf: text of the MJCF.
        texts: file -> text of the JSON files.
    """

    name: str
    data: Mapping[str, Any]
    spheres: Mapping[str, Any]
    hulls: Mapping[str, Any] | None
    mjcf: str
    texts: Mapping[str, str]


def describe_robot(name: str, files: Mapping[str, str], where: str = "") -> Description:
    """Returns the description of a robot in the texts of its files.

    Args:
        name: name of the robot.
        files: file -> text: robot.json, spheres.json, NAME.xml, and optionally hulls.json.
        where: begin of the messages.

    Raises:
        MmpError: for a missing or unknown file, or a fault in one, with file, field and value.
    """
    out = _described(name, files, ROBOT_FILE, where)
    place = f"{where}{ROBOT_FILE}: "
    _test_fields(out.data, _ROBOT_FIELDS, place)
    links = _test_robot(out.data, place)
    _test_spheres(out.spheres, links, f"{where}{SPHERES_FILE}: ")
    _test_ignored(out.data, lambda pair, at: _pair(pair, links, at), place)
    _test_hulls(out.hulls, links, f"{where}{HULLS_FILE}: ")
    _test_finite(out, where, ROBOT_FILE)
    return out


def describe_tool(name: str, files: Mapping[str, str], where: str = "") -> Description:
    """Returns the description of a tool in the texts of tool.json and the other files, see `describe_robot`."""
    out = _described(name, files, TOOL_FILE, where)
    place = f"{where}{TOOL_FILE}: "
    _test_fields(out.data, _TOOL_FIELDS, place)
    _pose(_member(out.data, "mount", place), f"{place}mount")
    _row(_member(out.data, "point", place), 3, f"{place}point", _LARGEST_M)
    if "opening" in out.data:
        _positive(out.data["opening"], f"{place}opening")
    _test_ignored(out.data, _text, place)
    _test_cover(out.data, place)
    for key, rows in _sphere_sets(out.spheres, f"{where}{SPHERES_FILE}: ").items():
        _test_rows(rows, f"{where}{SPHERES_FILE}: {key}")
    _test_hulls(out.hulls, [name], f"{where}{HULLS_FILE}: ")
    _test_finite(out, where, TOOL_FILE)
    return out


def _described(name: str, files: Mapping[str, str], main: str, where: str) -> Description:
    if not is_name(name):
        raise MmpError(f"{where}the name of the {main.removesuffix('.json')} is {shown(name)}; it must be {NAMES}")
    mjcf = f"{name}.xml"
    for file in (main, SPHERES_FILE, mjcf):
        if file not in files:
            raise MmpError(
                f"{where}{file} is missing; it must be there with {', '.join({main, SPHERES_FILE, mjcf} - {file})}"
            )
    for file, text in files.items():
        if file not in (main, SPHERES_FILE, HULLS_FILE, mjcf):
            raise MmpError(f"{where}{shown(file)} is not a file of a {main.removesuffix('.json')} called '{name}'")
        if not isinstance(text, str):
            raise MmpError(f"{where}{file} is {shown(text)}; it must be text")
    refuse_mjcf(files[mjcf], f"{where}{mjcf}")
    texts = {file: text for file, text in files.items() if file != mjcf}
    data, spheres, hulls = (_object(texts, file, where) for file in (main, SPHERES_FILE, HULLS_FILE))
    return Description(name=name, data=data or {}, spheres=spheres or {}, hulls=hulls, mjcf=files[mjcf], texts=texts)


def _object(texts: Mapping[str, str], file: str, where: str) -> dict[str, Any] | None:
    if file not in texts:
        return None
    try:
        value = json.loads(texts[file])
    except (ValueError, RecursionError) as error:
        raise MmpError(f"{where}{file} is not JSON: {error}") from None
    if not isinstance(value, dict):
        raise MmpError(f"{where}{file} is {shown(value)}; it must be an object")
    return value


def _test_fields(data: Mapping[str, Any], fields: Sequence[str], where: str) -> None:
    _known(data, fields, where)
    fingerprints = data.get("fingerprints", {})
    models = tuple(key for key in fingerprints if key.endswith(".xml")) if isinstance(fingerprints, dict) else ()
    inner = {"imported": _IMPORT_FIELDS, "approximate_sets_mm": _SETS, "protrusion_mm": _SETS}
    inner["fingerprints"] = (ROBOT_FILE, SPHERES_FILE, HULLS_FILE, *models)
    for key, known in inner.items():
        _known(data.get(key, {}), known, f"{where}{key}: ")
    for k, pair in enumerate(_list(data.get("self_pairs_ignored", []), f"{where}self_pairs_ignored")):
        _known(pair, _PAIR_FIELDS, f"{where}self_pairs_ignored[{k}]: ")
        _test_values(pair, _text, f"{where}self_pairs_ignored[{k}].")
    _test_told(data, where)


def _test_told(data: Mapping[str, Any], where: str) -> None:
    """Tests the kinds of values that are only for readers."""
    imported = data.get("imported", {})
    _number(imported.get("importer", 0), f"{where}imported.importer")
    for k, link in enumerate(_list(imported.get("held", []), f"{where}imported.held")):
        _text(link, f"{where}imported.held[{k}]")
    for key in ("source", "sha256", "root", "tip"):
        _text(imported.get(key, ""), f"{where}imported.{key}")
    for key in ("title", "state", "self_pairs"):
        if key in data:
            _text(data[key], f"{where}{key}")
    if "mass" in data:
        _number(data["mass"], f"{where}mass")
    for key in ("approximate_sets_mm", "hull_volumes_m3", "joint_values"):
        _test_values(data.get(key, {}), _number, f"{where}{key}.")
    _test_values(data.get("fingerprints", {}), _text, f"{where}fingerprints.")
    for k, pair in enumerate(_list(data.get("self_pairs_tested", []), f"{where}self_pairs_tested")):
        for link in _list(pair, f"{where}self_pairs_tested[{k}]", 2):
            _text(link, f"{where}self_pairs_tested[{k}]")


def _test_values(data: Any, test: Callable[[Any, str], object], where: str) -> None:
    if not isinstance(data, dict):
        raise MmpError(f"{where.rstrip('.')} is {shown(data)}; it must be an object")
    for key, value in data.items():
        test(value, f"{where}{key}")


def _test_finite(described: Description, where: str, main: str) -> None:
    """Refuses numbers that are too large also in fields that are only for readers."""
    require_finite(described.data, f"{where}{main}: ")
    require_finite((described.hulls or {}).get(_ORIGIN), f"{where}{HULLS_FILE}: {_ORIGIN}")


def _test_robot(data: Mapping[str, Any], where: str) -> list[str]:
    """Returns the names of the links."""
    links = _list(_member(data, "links", where), f"{where}links")
    for k, link in enumerate(links):
        _text(link, f"{where}links[{k}]")
        if not link or "/" in link or link in links[:k]:
            raise MmpError(f"{where}links[{k}] is {shown(link)}; links have different names without '/'")
    joints = _list(_member(data, "joints", where), f"{where}joints")
    if not 1 <= len(joints) <= MOST_JOINTS:
        raise MmpError(f"{where}joints has {len(joints)} entries; it must have 1 to {MOST_JOINTS}")
    if len(links) != len(joints) + 1:
        raise MmpError(f"{where}links has {len(links)} entries; it must have {len(joints) + 1}, one more than joints")
    for k, joint in enumerate(joints):
        _test_joint(joint, f"{where}joints[{k}]")
    _text(_member(data, "title", where), f"{where}title")
    _pose(_member(data, "flange", where), f"{where}flange")
    for key in ("home", "tucked"):
        values = _row(_member(data, key, where), len(joints), f"{where}{key}")
        for k, (value, joint) in enumerate(zip(values, joints, strict=True)):
            if not joint["lower"] <= value <= joint["upper"]:
                raise MmpError(
                    f"{where}{key}[{k}] is {value!r}; joint '{joint['name']}' goes from {joint['lower']!r} to"
                    f" {joint['upper']!r}"
                )
    if "draw_limits" in data:
        rows = _list(data["draw_limits"], f"{where}draw_limits", len(joints))
        for k, row in enumerate(rows):
            _row(row, 2, f"{where}draw_limits[{k}]")
            if not row[0] < row[1]:
                raise MmpError(f"{where}draw_limits[{k}] is {shown(row)}; its first number must be the smaller one")
    _positive(_member(data, "reach", where), f"{where}reach")
    published = _member(data, "acceleration_published", where)
    if not isinstance(published, bool):
        raise MmpError(f"{where}acceleration_published is {shown(published)}; it must be true or false")
    if (tool := _member(data, "default_tool", where)) is not None:
        _text(tool, f"{where}default_tool")
    if (rings := data.get("ring_spheres", "28")) not in _SETS:
        raise MmpError(f"{where}ring_spheres is {shown(rings)}; it must be 28, fine or exact")
    if _number(data.get("ring_height", 0.0), f"{where}ring_height", _LARGEST_M) < 0:
        raise MmpError(f"{where}ring_height is {data['ring_height']!r}; it must be 0 or above")
    _test_cover(data, where)
    return links


def _test_joint(joint: Any, where: str) -> None:
    _text(_member(joint, "name", f"{where}."), f"{where}.name")
    _known(joint, _JOINT_FIELDS, f"{where}: ")
    if joint.get("type", "hinge") not in ("hinge", "slide"):
        raise MmpError(f"{where}.type is {shown(joint['type'])}; it must be hinge or slide")
    _pose(_member(joint, "origin", f"{where}."), f"{where}.origin")
    axis = _row(_member(joint, "axis", f"{where}."), 3, f"{where}.axis")
    if abs(math.hypot(*axis) - 1) > 1e-6:
        raise MmpError(f"{where}.axis is {shown(axis)}; it must have length 1")
    lower, upper = (_number(_member(joint, key, f"{where}."), f"{where}.{key}") for key in ("lower", "upper"))
    if not lower < upper:
        raise MmpError(f"{where}.upper is {upper!r}; it must be above lower, {lower!r}")
    for key in ("velocity", "acceleration", "jerk", "effort"):
        _positive(_member(joint, key, f"{where}."), f"{where}.{key}")


def _test_cover(data: Mapping[str, Any], where: str) -> None:
    """Tests what a description says about the proved cover of its spheres."""
    for key, value in data.get("protrusion_mm", {}).items():
        if _number(value, f"{where}protrusion_mm.{key}") < 0:
            raise MmpError(f"{where}protrusion_mm.{key} is {value!r}; it must be 0 or above")
    _number(data.get("uncovered_mm", 0.0), f"{where}uncovered_mm")


def _test_ignored(data: Mapping[str, Any], test: Any, where: str) -> None:
    ignored = _sphere_sets(_member(data, "self_collision_ignore", where), f"{where}self_collision_ignore.")
    for key, entries in ignored.items():
        at = f"{where}self_collision_ignore.{key}"
        for k, entry in enumerate(_list(entries, at)):
            test(entry, f"{at}[{k}]")


def _pair(pair: Any, links: Sequence[str], where: str) -> None:
    for link in _list(pair, where, 2):
        if link not in links:
            raise MmpError(f"{where} names {shown(link)}, which is not a link")


def _test_spheres(data: Mapping[str, Any], links: Sequence[str], where: str) -> None:
    for key, by_link in _sphere_sets(data, where).items():
        if not isinstance(by_link, dict):
            raise MmpError(f"{where}{key} is {shown(by_link)}; it must be an object of link -> spheres")
        for link, rows in by_link.items():
            if link not in links:
                raise MmpError(f"{where}{key} names {shown(link)}, which is not a link")
            _test_rows(rows, f"{where}{key}.{link}")
        if not any(by_link.values()):
            raise MmpError(f"{where}{key} has no spheres; it needs at least one")
        if sum(map(len, by_link.values())) > _MOST_SPHERES:
            raise MmpError(f"{where}{key} has more than {_MOST_SPHERES:,} spheres, the most that a set may have")


def _test_rows(rows: Any, where: str) -> None:
    for k, row in enumerate(_list(rows, where)):
        _row(row, 4, f"{where}[{k}]", _LARGEST_M)
        if row[3] <= 0:
            raise MmpError(f"{where}[{k}][3] is {row[3]!r}; a radius must be above 0")
    if len(rows) > _MOST_SPHERES:
        raise MmpError(f"{where} has {len(rows)} spheres; it must have at most {_MOST_SPHERES:,}")


def _sphere_sets(data: Any, where: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise MmpError(f"{where.rstrip('.: ')} is {shown(data)}; it must be an object of sphere sets")
    for key in _REQUIRED_SETS if "exact" not in data else ():
        _member(data, key, where)
    for key in data:
        if key not in _SETS:
            raise MmpError(f"{where}{shown(key)} is not a sphere set; it must be 28, fine or exact")
    return data


def _test_hulls(data: Mapping[str, Any] | None, links: Sequence[str], where: str) -> None:
    hulls = vertices = 0
    for link, pieces in (data or {}).items():
        if link == _ORIGIN and link not in links:
            continue
        if link not in links:
            raise MmpError(f"{where}{shown(link)} is not a link; it must be one of {', '.join(links)}")
        for k, piece in enumerate(_list(pieces, f"{where}{link}")):
            at = f"{where}{link}[{k}]."
            points = _list(_member(piece, "vertices", at), f"{at}vertices")
            _known(piece, ("vertices", "radius"), f"{at[:-1]}: ")
            if not points:
                raise MmpError(f"{at}vertices is empty; a hull needs at least one")
            for j, point in enumerate(points):
                _row(point, 3, f"{at}vertices[{j}]", _LARGEST_M)
            if _number(_member(piece, "radius", at), f"{at}radius", _LARGEST_M) < 0:
                raise MmpError(f"{at}radius is {piece['radius']!r}; it must be 0 or above")
            hulls, vertices = hulls + 1, vertices + len(points)
    if hulls > _MOST_HULLS or vertices > _MOST_VERTICES:
        raise MmpError(
            f"{where}{hulls:,} hulls of {vertices:,} vertices are too many; at most {_MOST_HULLS:,} of"
            f" {_MOST_VERTICES:,} are read"
        )


def _member(data: Any, key: str, where: str) -> Any:
    if not isinstance(data, dict):
        raise MmpError(f"{where.rstrip('.: ')} is {shown(data)}; it must be an object")
    if key not in data:
        raise MmpError(f"{where}{key} is missing")
    return data[key]


def _known(data: Mapping[str, Any], fields: Sequence[str], where: str) -> None:
    """Raises `MmpError` for an unknown field. A misspelled one would otherwise have its default."""
    if not isinstance(data, dict):
        raise MmpError(f"{where.rstrip(': ')} is {shown(data)}; it must be an object")
    for key in data:
        if key not in fields:
            raise MmpError(f"{where}{UnknownNameError('field', shown(key)[1:-1], fields)}")


def _list(value: Any, where: str, count: int | None = None) -> list[Any]:
    if not isinstance(value, list) or count not in (None, len(value)):
        raise MmpError(f"{where} is {shown(value)}; it must be a list{'' if count is None else f' of {count}'}")
    return value


def _row(value: Any, count: int, where: str, largest: float = _LARGEST) -> list[float]:
    for k, number in enumerate(_list(value, where, count)):
        _number(number, f"{where}[{k}]", largest)
    return value


def _number(value: Any, where: str, largest: float = _LARGEST) -> float:
    if type(value) not in (int, float) or not -largest <= value <= largest:
        raise MmpError(f"{where} is {shown(value)}; it must be a number from {-largest:g} to {largest:g}")
    return value


def _positive(value: Any, where: str) -> None:
    if _number(value, where) <= 0:
        raise MmpError(f"{where} is {value!r}; it must be above 0")


def _text(value: Any, where: str) -> None:
    if not isinstance(value, str) or len(value) > _LONGEST_TEXT:
        raise MmpError(f"{where} is {shown(value)}; it must be text of at most {_LONGEST_TEXT} characters")


def _pose(value: Any, where: str) -> None:
    _row(_member(value, "xyz", f"{where}."), 3, f"{where}.xyz", _LARGEST_M)
    _row(_member(value, "rpy", f"{where}."), 3, f"{where}.rpy")
    _known(value, ("xyz", "rpy"), f"{where}: ")
