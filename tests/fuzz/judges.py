"""Judges a run: exit code, message, files that are left, and nonsense that was accepted."""

from __future__ import annotations

import csv
import itertools
import json
import re
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import yaml
from faults import whole_files

from fuzz import samples
from fuzz.json_values import numbers_of
from fuzz.option_validator import option_nonsense
from fuzz.validator import file_nonsense, violations, yaml_value

CODES = (0, 1, 2)
LONGEST_MESSAGE = 4000
"""Largest number of characters of a message."""
MOST_LINES = 3
"""Largest number of lines of a refusal."""
WARNED = re.compile(r".*\w*Warning: .*")
"""Warning that Python prints."""
SAY_WHAT_IS_WRONG = ("check", "export", "robot")
"""Commands that read files with faults, say what is wrong, and end with 1."""
REFUTING = ("check", "export")
"""Commands that end with 1 if the checker refutes a plan; `show` draws it."""
RAISED = re.compile(r"planner '.*' raised .*")
"""Message about a planner that raised."""
_BROKEN_ARRAYS = (EOFError, OSError, zipfile.BadZipFile, zlib.error)
LATE = ("diverged", "that is executed takes")
"""Messages about an execution, which comes after the plan is written."""


@dataclass(frozen=True)
class Run:
    """A command line, its exit code and what it printed; `folder` is where it ran, `before` the files there before.

    `native` is what libraries wrote to standard error past Python's streams.
    """

    line: list[str]
    code: int
    out: str
    err: str
    folder: Path
    before: dict[str, bytes]
    native: str = ""


def faults(run: Run) -> list[str]:
    """Returns what is wrong with a run, in words; nothing if all is well."""
    out = []
    if run.code not in CODES:
        out.append(f"exit code {run.code}")
    if "Traceback" in run.err or "Traceback" in run.out:
        out.append("traceback: " + run.err.strip().splitlines()[-1])
    if raised := RAISED.search(run.err):
        out.append(raised[0])
    out += _message_faults(run)
    return out + _files(run) + _nonsense(run)


def _message_faults(run: Run) -> list[str]:
    """Returns what is wrong with the messages of a run."""
    out = []
    said = [line for line in run.err.splitlines() if not line.startswith("usage:") and line.strip()]
    if run.code == 2 and not said:
        out.append("exit code 2 without a sentence")
    if run.code == 1 and not said and not run.out.strip():
        out.append("exit code 1 without a sentence")
    if run.code == 2 and len(said) > MOST_LINES:
        out.append(f"a message of {len(said)} lines")
    if run.code == 2 and len(run.err) > LONGEST_MESSAGE:
        out.append(f"a message of {len(run.err)} characters")
    if any(character < " " and character not in "\n\t\r" for character in run.err):
        out.append("control characters in a message")
    if warned := WARNED.search(run.err + run.native):
        out.append(f"a warning of Python: {warned[0]}")
    if run.native.strip():
        out.append(f"a library wrote: {run.native.strip().splitlines()[-1]}")
    return out


def _files(run: Run) -> list[str]:
    """Returns faults of the files that a run left."""
    out = []
    for name, content in run.before.items():
        path = run.folder / name
        if path.is_file() and path.read_bytes() == content:
            continue
        reason = _unreadable(path) if path.is_file() and run.code != 2 and _is_continued(run, name) else "an input"
        if reason:
            out.append(f"changed {name}, {reason}")
    new = sorted(
        path for path in run.folder.rglob("*") if path.is_file() and str(path.relative_to(run.folder)) not in run.before
    )
    if run.code == 2 and new and not _is_late(run):
        out.append(f"refused, and left {new[0].name}")
    for path in new:
        if path.name.startswith(".") or path.suffix in (".tmp", ".part"):
            out.append(f"left {path.name}")
        if reason := _unreadable(path):
            out.append(f"wrote {path.name} that cannot be used: {reason}")
    return out


def _is_late(run: Run) -> bool:
    """Returns whether a refusal may come when files are written already."""
    return "--retime" in run.line or run.line[0] in ("run", "report") or any(words in run.err for words in LATE)


def _is_continued(run: Run, name: str) -> bool:
    """Returns whether a command adds to a file that was there: that of a folder which it continues."""
    outputs = [word for option, word in itertools.pairwise(run.line) if option == "--out"]
    return run.line[0] in ("bench", "dataset") and any(Path(name).is_relative_to(folder) for folder in outputs)


def _unreadable(path: Path) -> str:
    """Returns why a written file cannot be used; nothing for a good one."""
    # A plan may be written under any name, and is JSON then.
    suffix = path.suffix if path.suffix in (".jsonl", ".yaml", *whole_files.READERS) else ""
    if suffix not in ("", ".jsonl", ".yaml") and (reason := whole_files.broken(path)):
        return reason
    try:
        if suffix == ".csv":
            rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
            numbers_of([[float(word) for word in row] for row in rows[1:]])
            return "rows of several lengths" if len({len(row) for row in rows}) > 1 else ""
        if suffix in ("", ".json", ".yaml"):
            numbers_of(yaml_value(path.read_bytes()) if suffix == ".yaml" else json.loads(path.read_bytes()))
        if suffix == ".jsonl":
            numbers_of([json.loads(row) for row in path.read_bytes().splitlines()])
        if suffix in (".xml", ".svg"):
            ElementTree.fromstring(path.read_bytes())
        if suffix == ".npz":
            with np.load(path) as arrays:
                numbers_of([arrays[name].tolist() for name in arrays])
    except (ValueError, RecursionError, yaml.YAMLError, ElementTree.ParseError, *_BROKEN_ARRAYS) as error:
        return str(error)
    return ""


def _nonsense(run: Run) -> list[str]:
    """Returns why what was accepted must not have been."""
    says_what_is_wrong = run.code == 1 and run.line[0] in SAY_WHAT_IS_WRONG
    if run.code not in (0, 1) or says_what_is_wrong:
        return []
    out = [f"accepted {reason}" for reason in option_nonsense(run.line)]
    read = {word.lstrip("@") for word in run.line}  # files, and folders
    if run.line[0] == "dataset":
        read |= {f"{folder}/episodes" for folder in read}
    for name, content in run.before.items():
        if name in read or str(Path(name).parent) in read or samples.NAMED_IN.get(name) in read:
            reasons = file_nonsense(name, content)
            if not reasons and run.code == 0 and run.line[0] in REFUTING:
                reasons = violations(content)
            out += [f"accepted {name}: {reason}" for reason in reasons]
    return out
