"""Nonsense in files and options that no program may accept. It shares no code with the readers of the program."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import PurePath
from typing import Any
from xml.etree import ElementTree

import yaml

from fuzz import (
    cell_validator,
    goal_validator,
    mesh_validator,
    plan_validator,
    record_validator,
    robot_validator,
    work_validator,
)
from fuzz.episode_validator import episode_nonsense
from fuzz.json_values import is_number, is_positive, items, leaves, numbers_of
from fuzz.known_keys import unknown_fields

MUST_DIFFER = ("arms", "obstacles", "jobs", "objects", "instances")
"""Keys of lists whose items have different names."""
LENGTHS = ("size", "radius", "length")
"""Keys of lengths [m] of a shape."""
POSITIVE = ("margin", "max_velocity", "max_acceleration", "max_jerk")
"""Keys of one number above 0, or of a list or object of them."""
NUMERIC = ("position", "positions", "quaternion", "times", "yaw", "margin", "scale", *LENGTHS)
"""Keys below which no truth value is."""
FREE = ("stats", "planner", "meta")
"""Keys below which anything may be."""
NAMED = ("robots", "tools")
"""Keys whose objects have names as keys, such as a robot that is called `quaternion`."""
MEASURED = ("limit", "axis", "origin", "mass", "joint", "body")
"""Tags of URDF and MJCF whose numbers are used. An inertia that no body has is replaced, and a note names its link."""
NO_KIND = "no schema, and no cell"
"""Reason against a document of no known kind."""
YAW = 2 * math.pi
"""Largest yaw in a cell file [rad]."""
BY_SCHEMA = {
    "mmp-instances/1": plan_validator.instances_nonsense,
    "mmp-plan/1": plan_validator.plan_nonsense,
    "mmp-episode/1": plan_validator.episode_nonsense,
    "mmp-jobs/1": work_validator.jobs_nonsense,
    "mmp-schedule/1": work_validator.schedule_nonsense,
    "mmp-bench/1": record_validator.settings_nonsense,
    "mmp-dataset/1": record_validator.dataset_nonsense,
}
"""Schema -> judge of a document."""
BY_NAME: dict[str, Callable[[Any], Iterator[str]]] = {
    "robot.json": robot_validator.robot_nonsense,
    "tool.json": robot_validator.tool_nonsense,
    "spheres.json": robot_validator.spheres_nonsense,
    "hulls.json": robot_validator.hulls_nonsense,
    "results.jsonl": record_validator.result_nonsense,
    "ends.json": lambda document: goal_validator.ends_nonsense(document, {}, is_start=False),
    "goal.json": lambda document: goal_validator.ends_nonsense(document, {}, is_start=False),
}
"""Name of a file without schema -> judge of it. Starts are judged like goals: either may be named as the other."""
VIOLATIONS = {
    "mmp-plan/1": plan_validator.plan_violations,
    "mmp-episode/1": plan_validator.episode_violations,
}
"""Schema -> function that yields what the checker must refute in a document that can be read."""


def file_nonsense(name: str, content: bytes) -> list[str]:
    """Returns why no program may accept a file, judged by the format that its name says."""
    suffix = PurePath(name).suffix
    try:
        if suffix in (".urdf", ".xml"):
            return _model_nonsense(content, suffix == ".urdf")
        if suffix == ".npz":
            return episode_nonsense(content)
        if suffix in mesh_validator.FORMATS:
            return mesh_validator.mesh_nonsense(suffix, content)
        return [reason for each in _documents(suffix, content) for reason in _document_nonsense(name, each)]
    except (ValueError, RecursionError, yaml.YAMLError, ElementTree.ParseError) as error:
        return [f"not {suffix}: {error}"]


def violations(content: bytes) -> list[str]:
    """Returns what the checker must refute in a plan or an episode that can be read; nothing of other files."""
    try:
        document = json.loads(content)
    except ValueError:
        return []
    judge = VIOLATIONS.get(str(document.get("schema"))) if isinstance(document, dict) else None
    return [] if judge is None else list(judge(document))


def _document_nonsense(name: str, document: Any) -> Iterator[str]:
    """Yields why no program may accept a document, judged by its schema, or by its name if it has none."""
    yield from reasons(document)
    if not isinstance(document, dict):
        if isinstance(document, list):
            yield "a list"
        return
    yield from unknown_fields(name, document)
    if "schema" in document:
        judge = BY_SCHEMA.get(str(document["schema"]))
        if judge is None:
            yield f"schema {str(document['schema'])[:60]}"
        else:
            yield from judge(document)
    elif (judge := BY_NAME.get(PurePath(name).name)) is not None:
        yield from judge(document)
    elif "arms" in document:
        yield from cell_validator.cell_nonsense(document, YAW)
    else:
        yield NO_KIND


def _documents(suffix: str, content: bytes) -> list[Any]:
    if suffix == ".json":
        return [json.loads(content)]
    if suffix == ".jsonl":
        rows = content.split(b"\n")[:-1]  # a last line without its end is of a run that was ended, and is left out
        return [json.loads(row) for row in rows]
    return [yaml_value(content)] if suffix in (".yaml", ".yml") else []


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # in C: Python takes half a second for an exported plan
    """A reader of YAML to which `1e3` without quotes is a number, as in JSON; to PyYAML it is text."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?[\d.]*\d[eE][-+]?\d+$"), list("-+.0123456789")
)


def yaml_value(content: bytes) -> Any:
    """Returns the value of a YAML document."""
    try:
        return yaml.load(content, Loader=_Loader)
    except (LookupError, AttributeError) as error:  # PyYAML raises them for a tag that does not fit its value
        raise ValueError(f"a tag that does not fit: {error}") from error


def reasons(document: Any) -> list[str]:
    """Returns why no program may accept a document."""
    out = []
    try:
        numbers_of(document)
    except ValueError as error:
        out.append(str(error))
    if not isinstance(document, dict | list):
        return [*out, "neither an object nor a list"]
    for value in _objects(document):
        out += _object_nonsense(value)
    return out


def _objects(document: Any) -> Iterator[dict[str, Any]]:
    """Yields all objects of a document that the program must understand."""
    todo = [document]
    while todo:
        value = todo.pop()
        if isinstance(value, dict):
            yield value
            for key, item in value.items():
                if key not in FREE:
                    todo += items(item) if key in NAMED else [item]
        elif isinstance(value, list):
            todo += value


def _object_nonsense(value: dict[str, Any]) -> Iterator[str]:
    for key in MUST_DIFFER:
        items = value.get(key)
        named = [str(item.get("name")) for item in items if isinstance(item, dict)] if isinstance(items, list) else []
        if len(set(named)) < len(named):
            yield f"two {key} of one name"
    for key in NUMERIC:
        if any(isinstance(leaf, bool) for leaf in leaves(value.get(key))):
            yield f"{key} {value[key]}"
    for key in LENGTHS:
        if key in value and "shape" in value and not all(is_positive(leaf) for leaf in leaves(value[key])):
            yield f"{key} {value[key]}"
    if "shape" in value and not all(is_number(leaf) and leaf != 0 for leaf in leaves(value.get("scale", 1.0))):
        yield f"scale {value['scale']}"  # a negative one mirrors the mesh
    for key in POSITIVE:
        if value.get(key) is not None and not all(is_positive(leaf) for leaf in leaves(value[key])):
            yield f"{key} {value[key]}"
    times = value.get("times")
    if isinstance(times, list) and not all(is_number(time) for time in times):
        yield f"times {times}"
    elif isinstance(times, list) and any(after < before for before, after in itertools.pairwise(times)):
        yield "times that go back"
    turn = value.get("quaternion")
    if isinstance(turn, list) and not (all(map(is_number, turn)) and math.hypot(*turn) > 0.0):
        yield f"quaternion {turn}"


def _model_nonsense(content: bytes, is_urdf: bool) -> list[str]:
    """Returns what is wrong in a URDF or MJCF model: names that are there twice, and numbers that are not finite."""
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError:
        if is_urdf:
            raise
        return []  # MuJoCo reads no further than the end of the model
    out = []
    for tag in ("link", "joint", "body"):
        named = [item.get("name") for item in root.iter(tag) if item.get("name")]
        if len(set(named)) < len(named):
            out.append(f"two {tag}s of one name")
    for item in root.iter():
        if item.tag in MEASURED:
            texts = [text for key, text in item.attrib.items() if key not in ("name", "type", "class")]
            out += [f"{item.tag} {text}" for text in texts if "nan" in text.lower().split()]
        if item.tag == "limit" and is_urdf and _number(item, "lower") > _number(item, "upper"):
            out.append("a lower limit above the upper one")
    return out


def _number(item: ElementTree.Element, key: str) -> float:
    return mesh_validator.parsed(item.get(key, "nan"))
