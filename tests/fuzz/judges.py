"""What is a fault: exit codes, messages, files that are left, and nonsense that was accepted."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CODES = (0, 1, 2)
LONGEST_MESSAGE = 4000
RAISED = re.compile(r"planner '.*' raised .*")
"""What the program says when a planner raised."""
MUST_DIFFER = ("arms", "obstacles", "jobs", "objects", "instances")
POSITIVE = ("size", "radius", "length", "scale")


@dataclass(frozen=True)
class Run:
    """A command line, its exit code and what it printed; `folder` is where it ran, `before` the files there before."""

    line: list[str]
    code: int
    out: str
    err: str
    folder: Path
    before: dict[str, bytes]


def faults(run: Run) -> list[str]:
    """Returns what is wrong with a run, in words; nothing if all is well."""
    out = []
    if run.code not in CODES:
        out.append(f"exit code {run.code}")
    if "Traceback" in run.err or "Traceback" in run.out:
        out.append("traceback: " + run.err.strip().splitlines()[-1])
    if raised := RAISED.search(run.err):
        out.append(raised[0])
    said = [line for line in run.err.splitlines() if not line.startswith("usage:") and line.strip()]
    if run.code == 2 and not said:
        out.append("exit code 2 without a sentence")
    if run.code == 2 and len(run.err) > LONGEST_MESSAGE:
        out.append(f"a message of {len(run.err)} characters")
    if any(character < " " and character not in "\n\t\r" for character in run.err):
        out.append("control characters in a message")
    return out + _files(run) + _nonsense(run)


def _files(run: Run) -> list[str]:
    """Returns faults of the files that a run left."""
    out = []
    for name, content in run.before.items():
        path = run.folder / name
        if not path.is_file() or path.read_bytes() != content:
            out.append(f"changed {name}")
    new = sorted(
        path for path in run.folder.rglob("*") if path.is_file() and str(path.relative_to(run.folder)) not in run.before
    )
    if run.code == 2 and new and "--retime" not in run.line and run.line[0] not in ("run", "report"):
        out.append(f"refused, and left {new[0].name}")
    for path in new:
        if path.name.startswith(".") or path.suffix in (".tmp", ".part"):
            out.append(f"left {path.name}")
        if path.suffix == ".json":
            try:
                numbers_of(json.loads(path.read_text(encoding="utf-8")))
            except ValueError as error:
                out.append(f"wrote {path.name} that is no JSON of finite numbers: {error}")
    return out


def numbers_of(value: Any) -> list[float]:
    """Returns all numbers of a document. Raises `ValueError` for one that is not finite."""
    if isinstance(value, bool):
        return []
    if isinstance(value, int | float):
        if not math.isfinite(value):
            raise ValueError(f"the number {value}")
        return [float(value)]
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [number for item in items for number in numbers_of(item)]


def _nonsense(run: Run) -> list[str]:
    """Returns why a file that was accepted must not have been."""
    read = [
        word.lstrip("@") for word in run.line if word.lstrip("@").endswith(".json") and word.lstrip("@") in run.before
    ]
    if run.code == 2 or run.line[0] in ("check", "report") or not read:
        return []
    out = []
    for name in read:
        try:
            document = json.loads(run.before[name])
        except (ValueError, RecursionError) as error:
            out.append(f"accepted {name}, which is no JSON: {error}")
            continue
        out += [f"accepted {name}: {reason}" for reason in reasons(document)]
    return out


def reasons(document: Any) -> list[str]:
    """Returns why no program may accept a document: the validator that shares no code with the readers."""
    out = []
    try:
        numbers_of(document)
    except (ValueError, OverflowError) as error:
        out.append(str(error))
    if not isinstance(document, dict | list):
        return [*out, "neither an object nor a list"]
    todo = [document]
    while todo:
        value = todo.pop()
        todo += value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
        if not isinstance(value, dict):
            continue
        for key in MUST_DIFFER:
            named = [item.get("name") for item in value.get(key) or () if isinstance(item, dict)]
            if len(set(map(str, named))) < len(named):
                out.append(f"two {key} of one name")
        for key in POSITIVE:
            measures = value.get(key)
            for measure in measures if isinstance(measures, list) else [measures]:
                if isinstance(measure, int | float) and not measure > 0 and "shape" in value:
                    out.append(f"{key} {measure}")
    return out
