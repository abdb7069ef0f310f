"""Queries about paths. A refusal of the system becomes an `MmpError` of one sentence.

`Path.exists` and its like raise for a folder without permission or a name that is too long, and `Path.resolve` for a
working directory that was deleted. So all code that takes paths of users uses this module.
"""

from __future__ import annotations

import errno
import os
import stat
from os import PathLike
from pathlib import Path

from mmp_env.errors import MmpError

_NOTHING_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)


def status(path: str | PathLike[str]) -> os.stat_result | None:
    """Returns the status of a file or folder behind any links; None if there is none.

    A name that is too long or holds a NUL byte names no file. Raises `MmpError` if the system refuses to look.
    """
    try:
        return os.stat(path)
    except ValueError:
        return None
    except OSError as error:
        if error.errno in _NOTHING_THERE:
            return None
        raise refusal(path, "looked at", error) from None


def exists(path: str | PathLike[str]) -> bool:
    """Returns whether there is anything at the path. Raises `MmpError` if the system refuses to look."""
    return status(path) is not None


def is_file(path: str | PathLike[str]) -> bool:
    """Returns whether there is a regular file at the path. Raises `MmpError` if the system refuses to look."""
    found = status(path)
    return found is not None and stat.S_ISREG(found.st_mode)


def is_folder(path: str | PathLike[str]) -> bool:
    """Returns whether there is a folder at the path. Raises `MmpError` if the system refuses to look."""
    found = status(path)
    return found is not None and stat.S_ISDIR(found.st_mode)


def real_path(path: str | PathLike[str]) -> Path:
    """Returns the absolute path without links of a file that may not be there yet.

    Raises `MmpError` if no file can be there, or if the system refuses to look.
    """
    try:
        real = os.path.realpath(path)
    except FileNotFoundError:
        raise MmpError(f"{path} cannot be found: the working directory was deleted") from None
    except (OSError, ValueError) as error:
        raise refusal(path, "found", error) from None
    try:
        os.lstat(real)
    except OSError as error:
        if error.errno not in (errno.ENOENT, errno.ENOTDIR):
            raise refusal(path, "found", error) from None
    return Path(real)


def refusal(path: str | PathLike[str], what: str, error: OSError | ValueError) -> MmpError:
    """Returns the error that a path cannot be read, written or the like (`what`), and why."""
    reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return MmpError(f"{path} cannot be {what}: {reason}")
