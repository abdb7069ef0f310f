"""Reads and writes folders of text files, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from mmp_env.errors import MmpError
from mmp_env.files.paths import refusal
from mmp_env.files.temporaries import beside, keep


def read_folder(folder: Path) -> dict[str, str]:
    """Returns the texts of all files in a folder, by their path in it."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(file.relative_to(folder)): file.read_text(encoding="utf-8") for file in files}


def write_folder(target: Path, files: Mapping[str, str]) -> None:
    """Writes a whole folder or none, in place of one that is there. Raises `MmpError`."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with beside(target) as new:
            new.mkdir()
            for name, text in files.items():
                (new / name).parent.mkdir(parents=True, exist_ok=True)
                (new / name).write_text(text, encoding="utf-8")
            move_folder(new, target)
    except OSError as error:
        raise refusal(target, "written", error) from None


def move_folder(new: Path, target: Path) -> None:
    """Moves a folder to `target`, in place of one that is there.

    Raises:
        OSError: if the system refuses; the folder that was there stays.
        MmpError: if it also refuses to move that folder back, which is then at another place.
    """
    with beside(target) as old:
        if not target.exists():
            os.rename(new, target)
            return
        os.rename(target, old)
        try:
            os.rename(new, target)
        except OSError as error:
            try:
                os.rename(old, target)
            except OSError:
                keep(old)
                raise MmpError(f"{refusal(target, 'written', error)}; the folder that was there is now {old}") from None
            raise
