"""Temporary files and folders. None is left when the program ends."""

from __future__ import annotations

import atexit
import contextlib
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from mmp_env.errors import MmpError

PREFIX = ".mmp-"
"""Beginning of the name of every temporary file."""
_THERE: dict[Path, int] = {}
"""Temporary path -> the process that made it."""


@contextlib.contextmanager
def beside(target: Path) -> Iterator[Path]:
    """Yields a path in the folder of `target` for a file or folder, and removes it in the end if it is still there."""
    path = target.with_name(f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}.tmp")
    _THERE[path] = os.getpid()  # listed before it is made: an interrupt at any instant leaves it listed or removed
    try:
        yield path
    finally:
        if path in _THERE:
            _remove(path)


def unnamed_file() -> IO[bytes]:
    """Returns an empty file without a name, such as for the output of another process. Raises `MmpError`."""
    try:
        return tempfile.TemporaryFile()
    except OSError as error:
        advice = "the variable TMPDIR names the folder for such files"
        raise MmpError(f"a temporary file cannot be made: {error.strerror}; {advice}") from None


def keep(path: Path) -> None:
    """Keeps a temporary file or folder."""
    _THERE.pop(path, None)


@atexit.register
def remove_all() -> None:
    """Removes all temporary files of this process, also those that an interrupted removal left."""
    for path, process in list(_THERE.items()):
        if process == os.getpid():  # a forked process inherits the list of its parent
            _remove(path)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
        _THERE.pop(path, None)  # otherwise `remove_all` tries once more
