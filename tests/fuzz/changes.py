"""Changes of files and options: mostly one small change, so that many changed inputs are accepted, sometimes brutal."""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib
import io
import itertools
import json
import math
import random
import re
import struct
from typing import Any

import numpy as np

from fuzz import core_arrays, mesh_samples
from fuzz.arguments import ARGUMENTS, OWN_ARGUMENTS, PLANNERS
from mmp_planners import describe, make

HOSTILE = [
    *(0, -1, 1e300, -1e300, 1e-300, 2**63, 10**400, float("nan"), float("inf"), -0.0, 0.5, True, False, None),
    *("", "x", "NaN", "\x00", "\x1b[31m", "a/b", "../x", "é\u202e", "x" * 5000),
    *([], {}, [[]], [0], {"a": 1}, [None] * 3),
]
"""Values in place of any value."""
LEFT_OUT = {
    "--help": "prints the help",
    "--ray": "looks for a cluster of other machines",
    "--out": "is in the lines that write files",
}
"""Option -> why it is not added."""


def command_of(line: list[str]) -> tuple[str, ...]:
    """Returns the command of a line, and its action where the command has several."""
    return tuple(line[:2] if line[0] in ("robot", "tool") else line[:1])


@functools.cache
def options(command: tuple[str, ...]) -> dict[str, bool]:
    """Returns the options of a command -> whether a value follows."""
    module = importlib.import_module(f"mmp_cli.{command[0]}")
    parser = getattr(module, f"_{command[1]}_parser")() if command[1:] else module.parser()
    found = {action.option_strings[-1]: action.nargs != 0 for action in parser._actions if action.option_strings}
    return {name: follows for name, follows in found.items() if name not in LEFT_OUT}


SETTINGS = {
    name: {option.name: () for option in describe(name).options}
    | {field.name: field.metadata.get("choices") or () for field in dataclasses.fields(make(name))}
    for name in PLANNERS
}
"""Planner -> its options -> their words."""
VALUES = [
    *("0", "-1", "1", "7", "1e-300", "1e-12", "1e-3", "0.3", "1e3", "1e6", "1e12", "1e300", "nan", "inf", "-inf"),
    *("", "x", "on", "off", "paper", "99999999999", "\u202e"),
]
"""Values in place of any value of a planner's option."""


def changed_file(content: bytes, rng: random.Random) -> bytes:
    """Returns a changed file: JSON by its values, NumPy's by its arrays, other files by their text."""
    if rng.random() < 0.1:
        return _changed_bytes(content, rng)
    if content.startswith(b"PK"):
        return _changed_arrays(content, rng)
    if content.startswith(b"glTF"):
        return _changed_glb(content, rng)
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return _changed_bytes(content, rng)
    try:
        document = json.loads(text)
    except ValueError:
        lines = text.splitlines(keepends=True)
        if lines and lines[0].startswith("{"):  # JSON lines
            k = rng.randrange(len(lines))
            lines[k] = json.dumps(_changed(json.loads(lines[k]), rng)) + "\n"
            return "".join(lines).encode()
        return _changed_text(text, rng).encode()
    for _ in range(1 if rng.random() < 0.8 else rng.randint(2, 6)):
        document = _changed(document, rng)
    return json.dumps(document).encode("utf-8", "surrogatepass")


def changed_line(line: list[str], rng: random.Random) -> list[str]:
    """Returns a changed command line."""
    line = list(line)
    places = [k for k in range(1, len(line) - 1) if line[k].startswith("--")]
    if places and rng.random() < 0.4:
        place = rng.choice(places)
        line[place + 1] = _argument(line[place], rng)
    else:
        known = options(command_of(line))
        option = rng.choice([*known, *(["--set"] * 2 if "--set" in known else [])])
        if option == "--set" and rng.random() < 0.9:
            return [*line, option, changed_setting(line, rng)]
        line += [option, _argument(option, rng)] if known[option] else [option]
    return line


def _argument(option: str, rng: random.Random) -> str:
    return rng.choice(rng.choice([ARGUMENTS, OWN_ARGUMENTS.get(option, ARGUMENTS)]))


def changed_setting(line: list[str], rng: random.Random) -> str:
    """Returns a changed option of the planner that the command line names, or of `auto`."""
    named = [planner for option, planner in itertools.pairwise(line) if option == "--planner" and planner in SETTINGS]
    options = SETTINGS[named[-1] if named else "auto"]
    option = rng.choice(list(options))
    return f"{option}={rng.choice(rng.choice([VALUES, options[option] or VALUES]))}"


def _places(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Returns the places of all values in a document."""
    out = [at] if at else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        out += _places(item, (*at, key))
    return out


def _changed(document: Any, rng: random.Random) -> Any:
    """Returns a document with one change."""
    document = copy.deepcopy(document)
    places = _places(document)
    if not places:
        return rng.choice(HOSTILE)
    *path, last = rng.choice(places)
    inner = document
    for key in path:
        inner = inner[key]
    value, kind = inner[last], rng.random()
    if kind < 0.5:
        inner[last] = _nearby(value, rng)
    elif kind < 0.75:
        inner[last] = rng.choice(HOSTILE)
    elif kind < 0.85:
        del inner[last]
    elif isinstance(inner, list):
        inner.insert(last, copy.deepcopy(value))
    elif kind < 0.95:
        inner[rng.choice([f"{last}x", "may_touch", "speed", "held", "keep", "quaternion", "yaw"])] = value
    else:
        other = rng.choice(places)
        target = document
        for key in other[:-1]:
            target = target[key] if isinstance(target, dict | list) else {}
        if isinstance(target, dict):
            target[other[-1]] = copy.deepcopy(value)
    return document


def _nearby(value: Any, rng: random.Random) -> Any:
    """Returns a value like the given one."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + rng.choice([-1, 1, 2, 10])
    if isinstance(value, float):
        return rng.choice(
            [-value, value * 1.001, value + rng.gauss(0, 0.1), value * 10, float(f"{value:.0f}"), value + 1e-6]
        )
    if isinstance(value, str):
        return rng.choice([value + "x", value[:-1], value.upper(), f" {value}", value * 2])
    if isinstance(value, list):
        return rng.choice([value[:-1], value[::-1], value * 2, [*value, *value[:1]]])
    if isinstance(value, dict):
        return dict(rng.sample(list(value.items()), len(value)))
    return rng.choice(HOSTILE)


def _changed_text(text: str, rng: random.Random) -> str:
    """Returns a text with another number, word or tag."""
    kinds = [r"-?\d+\.?\d*", r"\"[^\"]*\"", r"<[^<>]*>", r"[A-Za-z_]+", r"[^\n]*\n"]
    found = list(re.finditer(rng.choice(kinds[:2] if rng.random() < 0.7 else kinds), text))
    if not found:
        return text
    match = rng.choice(found)
    word = match.group()
    if re.fullmatch(kinds[0], word):
        number = float(word) if "." in word else int(word)
        others = [-number, number + 1, number * 1.01, number * 10, number + 0.05]
        new = str(rng.choice([*others, 0, 2**32 + 1, "1e300", "nan", "x", ""]))
    else:
        new = rng.choice([word * 2, "", word[:-1], '""', '"0 0 0"', '"nan nan nan"', '"1e9"', word])
    return text[: match.start()] + new + text[match.end() :]


def _changed_arrays(content: bytes, rng: random.Random) -> bytes:
    """Returns a file of NumPy's arrays in which one is missing, has another name, or is another array."""
    with np.load(io.BytesIO(content)) as file:
        arrays = dict(file)
    name, kind = rng.choice(list(arrays)), rng.random()
    if kind < 0.1:
        del arrays[name]
    elif kind < 0.2:
        arrays[rng.choice([f"{name}x", "x", *arrays])] = arrays[name]
    elif kind < 0.3:
        arrays[name] = arrays[name].astype(rng.choice([str, object]))
    else:
        arrays[name] = core_arrays.hostile_array(arrays[name], rng)
    out = io.BytesIO()
    (np.savez_compressed if rng.random() < 0.2 else np.savez)(out, **arrays)
    return out.getvalue()


def _changed_glb(content: bytes, rng: random.Random) -> bytes:
    """Returns a good file in glTF with another value in its document, or another number in its binary part."""
    document, binary = mesh_samples.parts_of_glb(content)
    if rng.random() < 0.5:
        return mesh_samples.glb_of_parts(_changed(document, rng), binary)
    at = 4 * rng.randrange(len(binary) // 4)
    real = struct.pack("<f", rng.choice([0.0, -0.05, 0.051, 1e30, math.nan, math.inf]))
    new = rng.choice([real, struct.pack("<I", rng.choice([0, 1, 7, 8, 2**31, 2**32 - 1]))])
    return mesh_samples.glb_of_parts(document, binary[:at] + new + binary[at + 4 :])


def _changed_bytes(content: bytes, rng: random.Random) -> bytes:
    """Returns a file that is cut, doubled or has other bytes."""
    at = rng.randrange(max(len(content), 1))
    return rng.choice(
        [
            content[:at],
            content + content,
            content[:at] + bytes(rng.randrange(256) for _ in range(4)) + content[at:],
            content[:at] + content[at + rng.randint(1, 20) :],
            content[:at] + struct.pack("<f", rng.choice([0.0, -1.0, 1e30, math.nan, math.inf])) + content[at + 4 :],
            b"",
            b"\xef\xbb\xbf" + content,
            content.replace(b"\n", b"\r\n"),
        ]
    )
