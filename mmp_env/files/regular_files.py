"""Reads the bytes of regular files and shell pipes, and refuses files that may never end."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from os import PathLike

from mmp_env.errors import MmpError
from mmp_env.files.paths import refusal

_BEGINNING_BYTES, _PART_BYTES = 2**16, 2**22


class TooLargeError(MmpError):
    """A file of more bytes than are read; `beginning` holds the first of them."""

    def __init__(self, message: str, beginning: bytes) -> None:
        super().__init__(message)
        self.beginning = beginning


def read_bytes(path: str | PathLike[str], limit: int | Callable[[bytes], int], kind: str) -> bytes:
    """Returns the content of a file of at most `limit` bytes. Raises `MmpError`.

    Args:
        path: the file.
        limit: the number of bytes, or a function that returns it for the beginning of the file.
        kind: format of the file, for messages.
    """
    try:
        if _may_never_end(path):
            raise OSError(errno.EINVAL, "it is not a regular file")
        with open(path, "rb") as file:
            parts = [file.read(_BEGINNING_BYTES)]
            most, size = limit(parts[0]) if callable(limit) else limit, len(parts[0])
            while parts[-1] and size <= most:  # in parts, because `read` takes all the memory that it is allowed
                parts.append(file.read(min(_PART_BYTES, most + 1 - size)))
                size += len(parts[-1])
            content = b"".join(parts)
    except (OSError, ValueError) as error:
        raise refusal(path, "read", error) from None
    check_size(path, content, most, kind)
    return content


def check_size(path: str | PathLike[str], content: bytes, limit: int, kind: str) -> None:
    """Raises `TooLargeError` for a file of more than `limit` bytes."""
    if len(content) > limit:
        message = f"{path} is larger than {limit / 2**20:g} MB, the most that is read of a {kind} file"
        raise TooLargeError(message, content[:_BEGINNING_BYTES])


def _may_never_end(path: str | PathLike[str]) -> bool:
    """Returns whether the path is a terminal, another device, or a named pipe, which may have no writer.

    A pipe of the shell, /dev/stdin or `<(...)`, has a writer.
    """
    mode = os.stat(path).st_mode
    name = os.path.abspath(path)
    piped_in = name == "/dev/stdin" or name.startswith(("/dev/fd/", "/proc/"))
    return stat.S_ISCHR(mode) or stat.S_ISBLK(mode) or (stat.S_ISFIFO(mode) and not piped_in)
