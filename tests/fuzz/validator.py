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

from fuzz import known_keys, mesh_validator
from fuzz.episode_validator import episode_nonsense
from fuzz.known_keys import unknown_fields, unknown_keys

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
OPTIONS = {
    **dict.fromkeys(("--time-limit", "--rate", "--max-velocity", "--max-acceleration", "--max-jerk", "--margin"), 0.0),
    **dict.fromkeys(("--tolerance", "--improve", "--delays"), 0.0),
    **dict.fromkeys(("--count", "--workers", "--memory-limit"), 1.0),
    "--seed": 0.0,
}
"""Option -> its least value; those with 0.0 of a number that is not whole must be larger."""
WHOLE = ("--seed", "--count", "--workers", "--memory-limit")
CHOICES = {
    "--format": ("npz", "minari"),
    "--control-mode": ("position", "velocity", "delta"),
    "--robot": ("ur5e", "panda", "fr5", "piper"),
    "--task": ("reach", "crossing", "parallel", "pick", "place", "packing"),
    "--planner": (
        *("auto", "group-rrt", "rrt-connect", "prioritized", "apf-ecbs", "apf-ecbs-nf", "ecbs", "gen-ecbs", "xecbs"),
        *("cbs", "cbs-mp"),
    ),
}
"""Option -> its words."""
NAMED_GOALS = {"--start": ("home", "tucked"), "--goal": ("home", "tucked", "stay"), "--keep": ()}
"""Option -> words in place of a configuration or a bound."""
COUNTS = {
    **dict.fromkeys(("shorten", "shortcuts", "improve", "rounds", "replan", "halvings"), 0),
    **dict.fromkeys(("iterations", "max_iterations", "patience", "most", "nodes"), 1),
}
"""Whole option of a planner -> its least value."""
LEAST = {
    "w": 1.0,
    "until": 1.0,
    "pad_growth": 1.0,
    **dict.fromkeys(("wait", "floor", "cap", "stretch", "exact_within"), 0.0),
}
"""Option of a planner -> its least value."""
ABOVE_0 = ("dt", "eta", "pad", "radius", "sphere_radius", "alpha", "k_rep", "d0", "step_rad", "range")
"""Options of planners that must be larger than 0. A `step` may be such a number, or a word."""
SWITCHES = ("restarts", "direct", "early_stop", "last_resort", "parked_yield", "shorten_paths", "static_tree", "trace")
SETTING_WORDS = {
    "preset": ("ours", "paper"),
    "bound": ("paths", "straight"),
    "conflict_choice": ("alternating", "earliest"),
    "constraint": ("avoid-state", "vertex", "avoid-path", "sphere", "priority", "priority-path", "split"),
    "distance": ("surface", "centre"),
    "step": ("normalised", "gradient"),
    "waits": ("removed", "kept"),
    "repulsion": ("off", "paths", "fast-track"),
    "fast_track": ("sound", "literal"),
    "fast_track_at": ("generation", "expansion"),
    "critical_arms": ("all", "cover", "one"),
    "misses": ("kept", "discarded"),
}
"""Option of a planner -> its words."""


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
        documents = _documents(suffix, content)
        return [reason for each in documents for reason in (*reasons(each), *unknown_fields(name, each))]
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
    """Returns why no program may accept the values of a command line's options."""
    return [f"{option} {word}" for option, word in itertools.pairwise(line) if _is_nonsense(option, word)]


def _is_nonsense(option: str, word: str) -> bool:
    if option in OPTIONS:
        return not all(_is_in_range(option, part.rpartition("=")[2]) for part in word.split(","))
    if option in CHOICES:
        return word not in CHOICES[option]
    if option == "--set":
        key, _, value = word.partition("=")
        return not _is_setting(key.rpartition(".")[2].replace("-", "_"), value)
    return option in NAMED_GOALS and not word.startswith("@") and not _is_goal(option, word)


def _is_in_range(option: str, text: str) -> bool:
    try:
        number = int(text) if option in WHOLE else float(text)
    except ValueError:
        return False
    if option == "--time-limit" and number == math.inf:
        return True
    least = OPTIONS[option]
    return least <= number < math.inf and (option in WHOLE or number > least)


def _is_setting(key: str, text: str) -> bool:
    """Returns whether an option of a planner may have a value. Those that are in no table are unknown."""
    if key in SWITCHES:
        return text in ("on", "off", "true", "false")
    if key == "kinds" or text in SETTING_WORDS.get(key, ()):
        return True
    try:
        number = float(text)
    except ValueError:
        return False
    if key in COUNTS:
        return number.is_integer() and number >= COUNTS[key]
    above_0 = key == "step" or key in ABOVE_0
    return math.isfinite(number) and (number > 0 if above_0 else key in LEAST and number >= LEAST[key])


def _is_goal(option: str, word: str) -> bool:
    """Returns whether a word may be a configuration, a goal or a bound, of one arm or of all."""
    table: dict[str, Any] = known_keys.OPTIONS[option]
    if word[:1] in ("{", "["):
        table = {known_keys.ARM: table}
    elif "=" in word:
        word = word.partition("=")[2]
        if word.startswith("@"):
            return True
    try:
        value = json.loads(word)
        numbers_of(value)
    except (ValueError, RecursionError):
        return word in NAMED_GOALS[option]
    if isinstance(value, dict | list):
        return not any(unknown_keys(value, table, set()))
    return isinstance(value, str) and value in NAMED_GOALS[option]


def _items(value: Any) -> list[Any]:
    return list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []


def _objects(document: Any) -> Iterator[dict[str, Any]]:
    """Yields all objects of a document that the program must understand."""
    todo = [document]
    while todo:
        value = todo.pop()
        if isinstance(value, dict):
            yield value
            for key, item in value.items():
                if key not in FREE:
                    todo += _items(item) if key in NAMED else [item]
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
    if "shape" in value and not all(_is_number(leaf) and leaf != 0 for leaf in _leaves(value.get("scale", 1.0))):
        yield f"scale {value['scale']}"  # a negative one mirrors the mesh
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
    return mesh_validator.parsed(item.get(key, "nan"))
