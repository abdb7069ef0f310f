"""Reads and writes folders of text files, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from mmp_env.files.paths import refusal
from mmp_env.files.temporaries import beside


def read_folder(folder: Path) -> dict[str, str]:
    """Returns the texts of all files in a folder, by their path in it."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(file.relative_to(folder)): file.read_text(encoding="utf-8") for file in files}


def write_folder(target: Path, files: Mapping[str, str]) -> None:
    """Writes a whole folder or none, in place of one that is there. Raises `MmpError`."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with beside(target) as new, beside(target) as old:
            new.mkdir()
            for name, text in files.items():
                (new / name).parent.mkdir(parents=True, exist_ok=True)
                (new / name).write_text(text, encoding="utf-8")
            _move_onto(new, target, old)
    except OSError as error:
        raise refusal(target, "written", error) from None


def _move_onto(new: Path, target: Path, old: Path) -> None:
    """Moves a folder to `target`, and one that is there to `old`; that one stays if `new` cannot be moved."""
    if not target.exists():
        os.rename(new, target)
        return
    os.rename(target, old)
    try:
        os.rename(new, target)
    except OSError:
        os.rename(old, target)
        raise
