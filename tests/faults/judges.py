"""Judges a run whose call failed: exit code, messages, output, and files that are half written or lost."""

from __future__ import annotations

from pathlib import Path

from faults.crashes import crashed_elsewhere
from faults.kit import HELPERS, Run
from faults.reports import entries, lost_output, lost_reports
from faults.whole_files import READERS, broken
from mmp_env.errors import NO_MEMORY
from mmp_env.files.temporaries import PREFIX as TEMPORARY

MORE_CODES = {"pipe": {141}, "memory": {1}, "kill": {1}}
"""Kind -> more exit codes than 0 and 2: nobody reads the output; a plan got no memory; a worker was killed."""
EXTENSION = "Importing the numpy C-extensions failed"
"""Beginning of the message of NumPy if it gets no memory while it is imported."""
OWN_CACHE = "cache/mmp-env"


def faults_of(run: Run, kind: str, good: Run) -> list[str]:
    """Returns what is wrong with a run, in words; `good` is the run of the same command where nothing failed."""
    ended = run.was_killed or (kind == "memory" and crashed_elsewhere(run))
    out = _faults_of_ending(run, kind, ended)
    out += [f"changed {name}" for name, content in run.before.items() if _content(run.folder / name) != content]
    if run.temporary and kind not in ("kill", "readonly") and not ended:  # nothing can be removed, after readonly
        out.append(f"left {run.temporary[0]}")
    out += [f"half-written {name}: {reason}" for name, path in _written(run).items() if (reason := broken(path))]
    if not (run.was_killed or TEMPORARY in run.err):  # a folder is replaced in two moves; a sentence says where it is
        out += [f"lost {name}" for name in run.there if name not in run.files]
    out += lost_reports(run, good)
    if run.code == 0:
        out += [f"exit code 0 without {name}" for name in good.files if name not in run.files]
        if not (kind == "memory" and NO_MEMORY in run.err):  # then a unit has the status error, and its row no times
            out += lost_output(run, good)
    return out


def _faults_of_ending(run: Run, kind: str, ended: bool) -> list[str]:
    """Returns what is wrong with the exit code and the messages; `ended` says that the process could not end well."""
    out = []
    waived = kind == "memory" and EXTENSION in run.err
    allowed = {0, 2} | MORE_CODES.get(kind, set())
    if run.code not in allowed and not ended:
        out.append(f"exit code {run.code}: {run.err.strip()[-300:]}")
    if ("Traceback" in run.err or "Traceback" in run.out) and not waived:
        out.append("traceback: " + (run.err.strip() or run.out.strip()).splitlines()[-1])
    if run.code in (1, 2) and not waived and not any(line.startswith("mmp") for line in run.err.splitlines()):
        out.append(f"exit code {run.code} without a sentence")
    return out


def _written(run: Run) -> dict[str, Path]:
    """Returns the files that a run wrote. Of other programs there are only those that have a reader."""
    out = {name: path for name, path in run.files.items() if name not in run.before}
    for path in sorted(each for helper in HELPERS for each in (run.folder / helper).rglob("*") if each.is_file()):
        name = str(path.relative_to(run.folder))
        if TEMPORARY not in name and (name.startswith(OWN_CACHE) or path.suffix in READERS):
            out[name] = path
    return out


def faults_after(again: Run, good: Run, kept: dict[str, bytes]) -> list[str]:
    """Returns what is wrong with the same command in the same folder, where now nothing fails.

    `kept` are the contents that the first run left in the files that a command adds to.
    """
    out = []
    if again.code != good.code:
        out.append(f"then exit code {again.code}: {again.err.strip()[-300:]}")
    out += [f"then no {name}" for name in good.files if name not in again.files]
    for name, content in kept.items():
        there = entries(name, _content(again.folder / name) or b"")
        lost = [entry for entry in entries(name, content) if entry not in there]
        out += [f"then lost {entry[:80]!r} of {name}" for entry in lost]
    return out


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None
