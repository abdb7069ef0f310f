"""Progress of an import of a robot or tool: a line on a terminal, otherwise a line every few seconds."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from mmp_cli.output import printable

if TYPE_CHECKING:
    from rich.progress import Progress

FIRST_S = 2.0
"""Time [s] after which the first line is printed where there is no terminal."""
PLAIN_EVERY_S = 10.0
"""Time [s] between the lines that follow."""


class ImportProgress:
    """A context manager whose value is called with each step that was done.

    It shows the last step on standard error: on a terminal at once, elsewhere in a long import only.
    """

    def __init__(self, command: str) -> None:
        self._command = command
        self._bar: Progress | None = None
        self._lines: PlainLines | None = None

    def __enter__(self) -> Callable[[str], None]:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        console = Console(stderr=True)
        if not console.is_terminal:
            self._lines = PlainLines(self._command)
            return self._lines.note
        columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
        self._bar = Progress(*columns, console=console, transient=True)
        task = self._bar.add_task("reading", total=None)
        self._bar.start()
        bar = self._bar
        return lambda line: bar.update(task, description=printable(line))

    def __exit__(self, *_: object) -> None:
        if self._bar:
            self._bar.stop()
        if self._lines:
            self._lines.stop()


class PlainLines:
    """Prints the last step now and then, also while a step takes long, until it is stopped."""

    def __init__(self, command: str) -> None:
        self._command, self._file = command, sys.stderr
        self._last, self._start_s = "reading", time.monotonic()
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        with contextlib.suppress(RuntimeError):  # no thread, no progress
            self._thread.start()

    def note(self, line: str) -> None:
        """Takes the step that was done last."""
        self._last = line

    def stop(self) -> None:
        """Ends the lines; none comes after it."""
        self._stopped.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        pause_s = FIRST_S
        with contextlib.suppress(OSError, ValueError, MemoryError):  # a closed or full standard error
            while not self._stopped.wait(pause_s):
                spent = f"{time.monotonic() - self._start_s:.0f} s"
                print(f"{self._command}: {spent}, last step: {printable(self._last)}", file=self._file, flush=True)
                pause_s = PLAIN_EVERY_S
