"""Compares what a command reported with what is there: its output, the files that it names, and the units done."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

from faults.kit import Run

_NUMBER = re.compile(r"\d[\d.]*(e[-+]?\d+)?")
_FOLDER = re.compile(r"\S*/faults-\S*/work\b")


def lost_output(run: Run, good: Run) -> list[str]:
    """Returns what the standard output lacks of that of the good run, where numbers may differ."""
    if "--json" in run.command.line:
        try:
            there = json.loads(run.out)
        except ValueError:
            return ["exit code 0 and half of the JSON"]
        return [f"exit code 0 without {key} in the JSON" for key in json.loads(good.out) if key not in there]
    return [f"exit code 0 without {line!r}" for line in _masked(good) - _masked(run)]


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


def entries(name: str, content: bytes) -> list[str]:
    """Returns the entries of a file that grows: its whole lines, or the instances of an index."""
    if name.endswith(".jsonl"):
        return [row.decode() for row in content.split(b"\n")[:-1]]
    try:
        return [json.dumps(entry, sort_keys=True) for entry in json.loads(content)["instances"]]
    except ValueError:
        return []  # then it is half written


def _masked(run: Run) -> Counter[str]:
    """Returns the lines of the standard output without numbers, widths of columns and the folder of the run."""
    lines = _NUMBER.sub("#", _FOLDER.sub("FOLDER", run.out)).splitlines()
    return Counter(" ".join(line.split()) for line in lines)


def _names(text: str, name: str) -> bool:
    return re.search(rf"(?<![\w/.-]){re.escape(name)}(?![\w/-])", text) is not None


def _episode_files(rows: list[str]) -> list[Path]:
    found = [json.loads(row).get("file") for row in rows]
    return [Path(file) for file in found if file]
