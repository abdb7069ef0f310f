"""Writing the files of a report: first all of them into a temporary folder, then each to its place."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Mapping
from pathlib import Path

from mmp_env.errors import MmpError
from mmp_env.files.temporaries import beside
from mmp_env.files.writing import move_onto

_PICTURES = "(cell|quickest|hardest|unsolved)-{name}[.]png"
_FIGURES = "(cactus|pairs|published)-{name}(-[0-9]+)?[.](svg|png)"
"""Patterns of the files that a report may have for a cell."""


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Writes name -> content into the folder, in this order. Raises `MmpError`; no file is half written."""
    with beside(folder / "report") as temporary:  # inside the folder, so that moving stays on one file system
        try:
            temporary.mkdir(0o700)
        except OSError as error:
            raise MmpError(f"{folder} cannot be written to: {error.strerror}") from None
        try:
            for name, content in files.items():
                # The name of a folder or a title may contain bytes that are not UTF-8.
                data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
                (temporary / name).write_bytes(data)
            for name in files:
                move_onto(temporary / name, folder / name)
        except OSError as error:
            raise MmpError(f"the report cannot be written to {folder}: {error.strerror}") from None


def remove_outdated(folder: Path, names: Iterable[str], kept: Container[str]) -> None:
    """Removes pictures and figures of an earlier report of the same cells, except those in `kept`.

    `names` are the cells' parts of the file names. Other files stay. Raises `MmpError`.
    """
    made = [re.compile(kind.replace("{name}", re.escape(name))) for name in names for kind in (_PICTURES, _FIGURES)]
    try:
        for path in sorted(folder.iterdir()):
            if path.name not in kept and path.is_file() and any(kind.fullmatch(path.name) for kind in made):
                path.unlink()
    except OSError as error:
        raise MmpError(f"{error.filename or folder} of an earlier report cannot be removed: {error.strerror}") from None
