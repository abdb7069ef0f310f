"""Nonsense in files and options that no program may accept. It shares no code with the readers of the program."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterator
from pathlib import PurePath
from typing import Any
from xml.etree import ElementTree

import yaml

MUST_DIFFER = ("arms", "obstacles", "jobs", "objects", "instances")
"""Keys of lists whose items have different names."""
LENGTHS = ("size", "radius", "length", "scale")
"""Keys of lengths [m] of a shape."""
POSITIVE = ("margin", "max_velocity", "max_acceleration", "max_jerk")
"""Keys of one number above 0, or of a list or object of them."""
NUMERIC = ("position", "positions", "quaternion", "times", "yaw", "margin", *LENGTHS)
"""Keys below which no truth value is."""
FREE = ("stats", "planner", "meta")
"""Keys below which anything may be."""
MEASURED = ("limit", "axis", "origin", "mass", "joint", "body")
"""Tags of URDF and MJCF whose numbers are used. An inertia that no body has is replaced, and a note names its link."""
OPTIONS = {
    **dict.fromkeys(("--time-limit", "--rate", "--max-velocity", "--max-acceleration", "--max-jerk", "--margin"), 0.0),
    **dict.fromkeys(("--count", "--workers"), 1.0),
    "--seed": 0.0,
}
"""Option -> its least value; those with 0.0 of a number that is not whole must be larger."""
WHOLE = ("--seed", "--count", "--workers")


def file_nonsense(name: str, content: bytes) -> list[str]:
    """Returns why no program may accept a file, judged by the format that its name says."""
    suffix = PurePath(name).suffix
    try:
        if suffix in (".urdf", ".xml"):
            return _model_nonsense(content, suffix == ".urdf")
        return [reason for document in _documents(suffix, content) for reason in reasons(document)]
    except (ValueError, RecursionError, yaml.YAMLError, ElementTree.ParseError) as error:
        return [f"not {suffix}: {error}"]


def _documents(suffix: str, content: bytes) -> list[Any]:
    if suffix == ".json":
        return [json.loads(content)]
    if suffix == ".jsonl":
        rows = content.split(b"\n")[:-1]  # a last line without its end is of a run that was ended, and is left out
        return [json.loads(row) for row in rows]
    return [_with_exponents(yaml_value(content))] if suffix in (".yaml", ".yml") else []


def yaml_value(content: bytes) -> Any:
    """Returns the value of a YAML document. The parser in Python takes half a second for an exported plan."""
    return yaml.load(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def _with_exponents(value: Any) -> Any:
    """Returns a YAML document in which `1e3` is a number; PyYAML reads it as text."""
    if isinstance(value, dict):
        return {key: _with_exponents(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_exponents(item) for item in value]
    return float(value) if isinstance(value, str) and re.fullmatch(r"[-+]?[\d.]*\d[eE][-+]?\d+", value) else value


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


def numbers_of(value: Any) -> list[float]:
    """Returns all numbers of a document. Raises `ValueError` for one that is not finite."""
    if isinstance(value, bool):
        return []
    if isinstance(value, int | float):
        if not abs(value) < math.inf or abs(value) > 1e308:
            raise ValueError("a number that is not finite")
        return [float(value)]
    return [number for item in _items(value) for number in numbers_of(item)]


def option_nonsense(line: list[str]) -> list[str]:
    """Returns why no program may accept the numbers of a command line's options."""
    out = []
    for option, word in itertools.pairwise(line):
        if option not in OPTIONS:
            continue
        for part in word.split(","):
            text = part.rpartition("=")[2]
            try:
                number = int(text) if option in WHOLE else float(text)
            except ValueError:
                out.append(f"{option} {word}")
                continue
            least = OPTIONS[option]
            if option == "--time-limit" and number == math.inf:
                continue
            if not least <= number < math.inf or (option not in WHOLE and number == least):
                out.append(f"{option} {word}")
    return out


def _items(value: Any) -> list[Any]:
    return list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []


def _objects(document: Any) -> Iterator[dict[str, Any]]:
    """Yields all objects of a document that the program must understand."""
    todo = [document]
    while todo:
        value = todo.pop()
        if isinstance(value, dict):
            yield value
            todo += [item for key, item in value.items() if key not in FREE]
        elif isinstance(value, list):
            todo += value


def _object_nonsense(value: dict[str, Any]) -> Iterator[str]:
    for key in MUST_DIFFER:
        items = value.get(key)
        named = [str(item.get("name")) for item in items if isinstance(item, dict)] if isinstance(items, list) else []
        if len(set(named)) < len(named):
            yield f"two {key} of one name"
    for key in NUMERIC:
        if any(isinstance(leaf, bool) for leaf in _leaves(value.get(key))):
            yield f"{key} {value[key]}"
    for key in LENGTHS:
        if key in value and "shape" in value and not all(_is_positive(leaf) for leaf in _leaves(value[key])):
            yield f"{key} {value[key]}"
    for key in POSITIVE:
        if value.get(key) is not None and not all(_is_positive(leaf) for leaf in _leaves(value[key])):
            yield f"{key} {value[key]}"
    times = value.get("times")
    if isinstance(times, list) and not all(_is_number(time) for time in times):
        yield f"times {times}"
    elif isinstance(times, list) and any(after < before for before, after in itertools.pairwise(times)):
        yield "times that go back"
    turn = value.get("quaternion")
    if isinstance(turn, list) and not (all(map(_is_number, turn)) and math.hypot(*turn) > 0.0):
        yield f"quaternion {turn}"


def _leaves(value: Any) -> list[Any]:
    """Returns all scalars below a value."""
    if isinstance(value, dict | list):
        return [leaf for item in _items(value) for leaf in _leaves(item)]
    return [] if value is None else [value]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_positive(value: Any) -> bool:
    return _is_number(value) and value > 0


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
    try:
        return float(item.get(key, "nan"))
    except ValueError:
        return math.nan
