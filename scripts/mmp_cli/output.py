"""Output of the program: safe text, tables, and streams that report their failures.

A name in a file or the message of a planner may contain escape codes. They are printed as text such as `\\x1b`.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.table import Table

_FILE_WIDTH = 160
"""Largest width of a table in a file [characters]."""
LONGEST_MESSAGE = 1000
"""Characters of a message that are shown; a plug-in may write as many as it likes."""


class OutputError(Exception):
    """Standard output cannot be written. `is_unread`: its reader has gone, as `head` does."""

    def __init__(self, error: OSError) -> None:
        super().__init__("standard output is closed" if error.errno == errno.EBADF else error.strerror)
        self.is_unread = isinstance(error, BrokenPipeError)


def say(*lines: object) -> None:
    """Prints lines to standard output."""
    print(*(printable(str(line)) for line in lines), sep="\n")


def complain(message: BaseException | str, *, program: str = "mmp") -> None:
    """Prints one sentence to standard error, shortened if it is very long."""
    print(f"{program}: {shortened(one_line(message))}", file=sys.stderr)


def shortened(text: str) -> str:
    """Returns the text, or its beginning with `...` and its length if it is longer than `LONGEST_MESSAGE`."""
    end = f"... ({len(text)} characters in all)"
    return text if len(text) <= LONGEST_MESSAGE else text[: LONGEST_MESSAGE - len(end)] + end


def print_rows(rows: Iterable[tuple[str, str, str]]) -> None:
    """Prints a table of two columns: a name, which has a style, and a text."""
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 2))
    for name, style, text in rows:
        table.add_row(Text(printable(name), style=style), Text(printable(text)))
    print_table(table)


def print_table(table: Table) -> None:
    """Prints a table as wide as the terminal, or in a file as wide as its lines need."""
    from rich.console import Console

    console = Console()
    if console.is_terminal:
        console.print(table)
        return
    console = Console(width=_FILE_WIDTH)
    with console.capture() as capture:
        console.print(table)
    print("\n".join(line.rstrip() for line in capture.get().splitlines()))


def one_line(message: BaseException | str) -> str:
    """Returns the message on one line and without control characters."""
    return printable(" ".join(str(message).split()))


def printable(text: str) -> str:
    """Returns the text with escapes such as `\\x1b` for every character that does not print, line breaks included."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def guard_streams() -> None:
    """Lets standard output raise `OutputError` if it fails, and standard error fail silently.

    A stream that the caller has closed is reopened to nowhere. Otherwise the next file that is opened would get its
    number, and the program would write its output into that file.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDONLY)  # the lowest number that is free, which is this one
    sys.stdout = _text(_Output(1, "w", closefd=False), sys.stdout)
    sys.stderr = _text(_Messages(2, "w", closefd=False), sys.stderr)


def forget_output() -> None:
    """Discards what standard output still buffers, also at the end of the process."""
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
    """Returns a text stream with the encoding of the former one; it escapes characters that the encoding lacks."""
    encoding = getattr(before, "encoding", "utf-8")
    # With PYTHONUNBUFFERED streams are unbuffered; the new ones must not buffer either.
    at_once = getattr(before, "line_buffering", True) or getattr(before, "write_through", False)
    return io.TextIOWrapper(
        io.BufferedWriter(file), encoding=encoding, errors="backslashreplace", line_buffering=at_once
    )
