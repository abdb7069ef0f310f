"""Finds files that were there before a run and are gone after it, and folders that are half replaced."""

from __future__ import annotations

import re
from pathlib import Path

from faults.kit import Run
from mmp_env.files.temporaries import PREFIX as TEMPORARY

_MOVED = re.compile(rf"is now (\S*{re.escape(TEMPORARY)}[^\s;,]+)")
"""Part of a sentence that says where a folder is now."""


def faults_of_losses(run: Run, good: Run) -> list[str]:
    """Returns which files are lost, and which folder or sentence is wrong, in words.

    A folder is replaced in two moves. A process that SIGKILL ended between them leaves the old folder under a temporary
    name. A process that can move the folder neither to its name nor back leaves it there too, and says where it is.
    """
    names = [name.rstrip(".") for name in _MOVED.findall(run.err)]
    moved = [run.folder / name for name in names]
    out = [f"says {name}, which is not there" for name in names if not (run.folder / name).is_dir()]
    lost = [name for name in run.there if name not in run.kept]
    if folder := run.command.replaces:
        old, now = _inside(run.there, folder), _inside(run.contents, folder)
        places = _temporary_folders(run.folder / folder) if run.was_killed else moved
        if not now and any(_contents(place) == old for place in places):
            lost = [name for name in lost if not name.startswith(f"{folder}/")]
        if now and now not in (old, _inside(good.contents, folder)):
            out.append(f"{folder} is neither the old nor the new folder")
    return out + [f"lost {name}" for name in lost]


def _temporary_folders(folder: Path) -> list[Path]:
    return [path for path in folder.parent.glob(f"{TEMPORARY}*") if path.is_dir()]


def _inside(contents: dict[str, bytes], folder: str) -> dict[str, bytes]:
    """Returns the files in a folder, by their path in it."""
    return {name.removeprefix(f"{folder}/"): each for name, each in contents.items() if name.startswith(f"{folder}/")}


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
