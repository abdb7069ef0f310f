"""Compares what a command reported with what is there: its output, the files that it names, and the units done."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

from faults.growing_files import entries, fields
from faults.kit import Run

NUMBER = re.compile(r"\d[\d.]*(e[-+]?\d+)?")
_FOLDER = re.compile(r"\S*/faults-\S*/work\b")


def lost_output(run: Run, good: Run, *, again: bool = False) -> list[str]:
    """Returns what the standard output lacks of that of the good run, where numbers may differ.

    Where a command runs `again`, it may leave out the lines that depend on what an earlier run left.
    """
    if "--json" in run.command.line:
        try:
            there = json.loads(run.out)
        except ValueError:
            return ["exit code 0 and half of the JSON"]
        missing = _places(json.loads(good.out)) - _places(there)
        return [f"exit code 0 without {place} in the JSON" for place in sorted(missing)]
    missing = sorted((_masked(good) - _masked(run)).elements())
    depends = re.compile(run.command.depends)
    return [f"exit code 0 without {line!r}" for line in missing if not (again and depends.match(line))]


def lost_reports(run: Run, good: Run) -> list[str]:
    """Returns the files and units that a run reported as written, and that are not there."""
    named = [name for name in good.files if name not in good.before and _names(run.out, name)]
    out = [f"reported {name}, which is not there" for name in named if name not in run.files]
    for name in run.command.adds:
        done = max(map(int, re.findall(run.command.done, run.err, re.MULTILINE)), default=0)
        path = run.folder / name
        rows = entries(name, path.read_bytes()) if path.is_file() else []
        if len(rows) < done:
            out.append(f"reported {done} done, and {name} has {len(rows)}")
        out += [f"{file} of {name} is not there" for file in _episode_files(rows) if not (path.parent / file).is_file()]
    return out


def _masked(run: Run) -> Counter[str]:
    """Returns the lines of the standard output without numbers, widths of columns and the folder of the run."""
    lines = NUMBER.sub("#", _FOLDER.sub("FOLDER", run.out)).splitlines()
    return Counter(" ".join(line.split()) for line in lines)


def _places(value: Any, at: str = "") -> set[str]:
    """Returns the place of each value in a document, such as `a.0.b`."""
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return {f"{at}{key}" for key, _ in parts}.union(*(_places(part, f"{at}{key}.") for key, part in parts))


def _names(text: str, name: str) -> bool:
    return re.search(rf"(?<![\w/.-]){re.escape(name)}(?![\w/-])", text) is not None


def _episode_files(rows: list[str]) -> list[Path]:
    found = [fields(row).get("file") for row in rows]
    return [Path(file) for file in found if file]
