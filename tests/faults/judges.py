"""What is a fault of a run whose call failed: exit codes, messages, and files that are half written or lost."""

from __future__ import annotations

import csv
import json
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from faults.kit import HELPERS, Run

UNREAD = 141
EXTENSION = "Importing the numpy C-extensions failed"
"""Beginning of what NumPy says if it gets no memory while it is imported."""


def faults_of(run: Run, kind: str, good: Run) -> list[str]:
    """Returns what is wrong with a run, in words; `good` is the run of the same command where nothing failed."""
    out = []
    allowed = {0, 2, UNREAD} | ({1} if kind in ("memory", "kill") else set())
    ended = run.was_killed or (kind == "memory" and run.crashed_elsewhere)
    if run.code not in allowed and not ended:
        out.append(f"exit code {run.code}")
    if "Traceback" in run.err or "Traceback" in run.out:
        out.append("traceback: " + (run.err.strip() or run.out.strip()).splitlines()[-1])
        if kind == "memory" and EXTENSION in run.err:
            return []
    said = [line for line in run.err.splitlines() if line.startswith("mmp")]
    if run.code == 2 and not said:
        out.append("exit code 2 without a sentence")
    out += [f"changed {name}" for name, content in run.before.items() if _content(run.folder / name) != content]
    if run.temporary and kind != "kill" and not ended:
        out.append(f"left {run.temporary[0]}")
    for name, path in run.files.items():
        if name not in run.before and (reason := broken(path)):
            out.append(f"half-written {name}: {reason}")
    for helper in HELPERS:
        out += [
            f"half-written {path.name}: {reason}"
            for path in (run.folder / helper).rglob("*")
            if path.is_file() and (reason := broken(path)) and not path.name.startswith(".mmp-")
        ]
    if run.code == 0:
        out += [f"exit code 0 without {name}" for name in good.files if name not in run.files]
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
        there = _entries(name, _content(again.folder / name) or b"")
        lost = [entry for entry in _entries(name, content) if entry not in there]
        out += [f"then lost {entry[:80]!r} of {name}" for entry in lost]
    return out


def broken(path: Path) -> str | None:
    """Returns why a file is not whole, or None."""
    if path.name == "results.jsonl":
        return _reason(_rows, path)
    return _reason(READERS[path.suffix], path) if path.suffix in READERS else None


def _reason(read: Callable[[Path], object], path: Path) -> str | None:
    try:
        read(path)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def _rows(path: Path) -> None:
    """Reads the whole lines of a file that grows by lines; the last one may be without its end."""
    for row in path.read_bytes().split(b"\n")[:-1]:
        json.loads(row)


def _csv(path: Path) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    _require(len(rows) > 1 and len({len(row) for row in rows}) == 1, "rows of several lengths")
    _require(path.read_bytes().endswith(b"\n"), "no end of the last line")


def _npz(path: Path) -> None:
    _require(zipfile.ZipFile(path).testzip() is None, "a member is damaged")
    with np.load(path) as arrays:
        for name in arrays.files:
            assert arrays[name] is not None


def _picture(path: Path) -> None:
    with Image.open(path) as picture:
        for frame in range(getattr(picture, "n_frames", 1)):
            picture.seek(frame)
            picture.load()


def _rrd(path: Path) -> None:
    from support import recordings

    _require(bool(recordings.Rows(path).entities), "nothing in it")


def _mp4(path: Path) -> None:
    content = path.read_bytes()
    _require(b"moov" in content and b"mdat" in content, "no index or no data")


def _html(path: Path) -> None:
    _require(path.read_text(encoding="utf-8").rstrip().endswith("</html>"), "no end of the page")


def _markdown(path: Path) -> None:
    _require(path.read_text(encoding="utf-8").endswith("\n"), "no end of the last line")


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)


READERS: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")),
    ".svg": ET.parse,
    ".xml": ET.parse,
    ".yaml": lambda path: _require(bool(yaml.safe_load(path.read_text(encoding="utf-8"))), "empty"),
    ".csv": _csv,
    ".npz": _npz,
    ".rrd": _rrd,
    ".mp4": _mp4,
    ".html": _html,
    ".md": _markdown,
} | dict.fromkeys((".png", ".jpg", ".webp", ".gif"), _picture)
"""Suffix -> reader that fails for a file that is not whole."""


def _entries(name: str, content: bytes) -> list[str]:
    """Returns what a file that grows has: its whole lines, or the instances of an index."""
    if name.endswith(".jsonl"):
        return [row.decode() for row in content.split(b"\n")[:-1]]
    return [json.dumps(entry, sort_keys=True) for entry in json.loads(content)["instances"]] if content else []


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None
