"""Judges a run whose call failed: exit code, messages, output, and files that are half written or lost."""

from __future__ import annotations

from pathlib import Path

from faults.crashes import crashed_elsewhere
from faults.growing_files import has_errors
from faults.kit import AGAIN, Run
from faults.lost_files import faults_of_losses
from faults.reports import lost_output, lost_reports
from faults.written_files import faults_of_files
from mmp_env.errors import NO_MEMORY

MORE_CODES = {"pipe": {141}, "memory": {1}, "kill": {1}}
"""Kind -> more exit codes than 0 and 2: nobody reads the output; a plan got no memory; a worker was killed."""
EXTENSION = "Importing the numpy C-extensions failed"
"""Beginning of the message of NumPy if it gets no memory while it is imported."""
SUCCEEDS = ("stderr", "closed", AGAIN)
"""Kinds in which only messages are lost, or nothing fails: the exit code is that of the good run."""


def faults_of(run: Run, kind: str, good: Run) -> list[str]:
    """Returns what is wrong with a run, in words; `good` is the run of the same command where nothing failed."""
    ended = run.was_killed or is_excused(run, kind)
    out = _faults_of_ending(run, kind, ended)
    if kind in SUCCEEDS and run.code != good.code:
        out.append(f"exit code {run.code} instead of {good.code}: {run.err.strip()[-300:]}")
    out += [f"changed {name}" for name, content in run.before.items() if _content(run.folder / name) != content]
    if run.temporary and kind not in ("kill", "readonly") and not ended:  # nothing can be removed, after readonly
        out.append(f"left {run.temporary[0]}")
    out += faults_of_files(run, kind, good)
    out += faults_of_losses(run, good)
    out += lost_reports(run, good)
    if run.code == 0:
        out += [f"exit code 0 without {name}" for name in good.files if name not in run.files]
        if not _lacks_times(run, kind):
            out += lost_output(run, good, again=kind == AGAIN)
    return out


def is_excused(run: Run, kind: str) -> bool:
    """Returns True if a library crashed that does not survive too little memory."""
    return kind == "memory" and crashed_elsewhere(run)


def _lacks_times(run: Run, kind: str) -> bool:
    """Returns True if a unit, of this or an earlier run, has the status error, so that its row has no times."""
    return (kind == "memory" and NO_MEMORY in run.err) or (kind == AGAIN and has_errors(run))


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


def faults_after(again: Run, good: Run) -> list[str]:
    """Returns what is wrong with the same command in the same folder, where now nothing fails, in words."""
    return [f"then {each}" for each in faults_of(again, AGAIN, good)]


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None
