"""What the program prints: text that no name can spoil, on streams whose failure is told apart from every other.

A name in a file, or the message of a planner, may hold escape codes. They are shown as text, never sent to a terminal.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Any, TextIO

LONGEST_MESSAGE = 1000
"""Characters of a message that are shown; a plug-in may write as many as it likes."""


class OutputError(Exception):
    """Standard output took no more. `is_unread`: its reader has gone, as `head` does."""

    def __init__(self, error: OSError) -> None:
        super().__init__("standard output is closed" if error.errno == errno.EBADF else error.strerror)
        self.is_unread = isinstance(error, BrokenPipeError)


def say(*lines: object) -> None:
    """Prints lines on standard output."""
    print(*(printable(str(line)) for line in lines), sep="\n")


def complain(message: BaseException | str, *, program: str = "mmp") -> None:
    """Prints one sentence on standard error, shortened where it is very long."""
    print(f"{program}: {shortened(one_line(message))}", file=sys.stderr)


def shortened(text: str) -> str:
    """Returns the text, or its beginning with `...` and its length if it is longer than `LONGEST_MESSAGE`."""
    end = f"... ({len(text)} characters in all)"
    return text if len(text) <= LONGEST_MESSAGE else text[: LONGEST_MESSAGE - len(end)] + end


def one_line(message: BaseException | str) -> str:
    """The message without line breaks and control characters, which names in a file may hold."""
    return printable(" ".join(str(message).split()))


def printable(text: str) -> str:
    """The text with escapes such as `\\x1b` in place of everything that does not print, line breaks included."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def guard_streams() -> None:
    """Makes standard output raise `OutputError` where it fails, and standard error fail in silence.

    The exit code alone tells what standard error could not say. A stream that the caller has closed keeps its number:
    otherwise the next file that is opened would get it, and be written to.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDONLY)  # the lowest number that is free, which is this one
    sys.stdout = _text(_Output(1, "w", closefd=False), sys.stdout)
    sys.stderr = _text(_Messages(2, "w", closefd=False), sys.stderr)


def forget_output() -> None:
    """Sends nowhere what standard output still holds, at the end of the process too."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)


class _Output(io.FileIO):
    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise OutputError(error) from None


class _Messages(io.FileIO):
    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


def _text(file: io.FileIO, before: TextIO | None) -> io.TextIOWrapper:
    """Text of the encoding that there was before; characters that it lacks are written as escapes."""
    encoding = getattr(before, "encoding", "utf-8")
    # With PYTHONUNBUFFERED streams are not line-buffered but write through; they must hold nothing back here either.
    at_once = getattr(before, "line_buffering", True) or getattr(before, "write_through", False)
    return io.TextIOWrapper(
        io.BufferedWriter(file), encoding=encoding, errors="backslashreplace", line_buffering=at_once
    )
