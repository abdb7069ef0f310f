"""Files and folders that are there for a moment beside the place of another, and at no end of the program."""

from __future__ import annotations

import atexit
import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

PREFIX = ".mmp-"
"""Beginning of the name of every temporary file."""
_THERE: dict[Path, int] = {}
"""What may be there -> the process that has made it."""


@contextlib.contextmanager
def beside(target: Path) -> Iterator[Path]:
    """A name in the folder of `target` for a file or a folder, which is removed in the end if it is still there."""
    path = target.with_name(f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}.tmp")
    _THERE[path] = os.getpid()  # before it is made: an interrupt at any instant leaves it in the list or removed
    try:
        yield path
    finally:
        _remove(path)


@atexit.register
def remove_all() -> None:
    """Removes what an interrupt in the middle of a removal has left; for those who end a process by force."""
    for path, process in list(_THERE.items()):
        if process == os.getpid():  # a fork has the list of its parent
            _remove(path)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
    _THERE.pop(path, None)
