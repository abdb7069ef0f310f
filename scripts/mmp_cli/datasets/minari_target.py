"""The folder of the Minari dataset: its name, and the refusal of one that holds what `mmp dataset` did not write."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from mmp_cli.datasets.folder import EPISODES
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists

VERSION = "expert-v0"
MADE_BY = "made by mmp dataset"
"""Words in the description of every Minari dataset of `mmp dataset`."""
_METADATA = f"{VERSION}/data/metadata.json"
_FILES = {"namespace_metadata.json", f"{VERSION}/data/main_data.hdf5", _METADATA}
_FOLDERS = {str(folder) for file in _FILES for folder in PurePosixPath(file).parents}
_SHORTEST, _LONGEST = 2, 60
"""Least length that Minari takes, and most characters: file systems take 255 bytes, and a character has up to 4."""


def minari_name(title: str) -> str:
    """Returns the name of the Minari dataset of a cell. It fits Minari and is no other entry of the folder.

    Args:
        title: name of the cell, and of its robot if it was exchanged.
    """
    name = re.sub(r"[^-\w]", "-", title)[:_LONGEST]
    is_taken = name.casefold() == EPISODES  # some file systems take upper and lower case for the same
    is_option = name.startswith("-")  # to `minari show`
    return f"cell-{name}" if is_taken or is_option or len(name) < _SHORTEST else name


def check_target(target: Path) -> None:
    """Raises `MmpError` if something is at `target` that no `mmp dataset` wrote."""
    if target.is_symlink() or (exists(target) and not target.is_dir()):
        raise MmpError(f"{target} is no folder that mmp dataset wrote; move it, or give another --out")
    for path in _foreign(target):
        raise MmpError(
            f"{target} holds {path}, which no mmp dataset wrote and which would be lost; move it, or give another --out"
        )


def _foreign(target: Path) -> Iterator[Path]:
    """Yields the paths in the folder that no `mmp dataset` writes, in the order of their names."""
    if not exists(target):
        return
    for path in sorted(target.rglob("*")):
        name = path.relative_to(target)
        is_own = path.is_file() if str(name) in _FILES else str(name) in _FOLDERS and path.is_dir()
        if path.is_symlink() or not is_own:
            yield name
    if exists(target / VERSION) and MADE_BY not in _description(target):
        yield Path(VERSION)


def _description(target: Path) -> str:
    try:
        return str(json.loads((target / _METADATA).read_text(encoding="utf-8"))["description"])
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return ""
