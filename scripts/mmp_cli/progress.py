"""The progress lines of `mmp plan` and `mmp run`, which show the state of the planning on the terminal."""

from __future__ import annotations

import time
from typing import TypeVar

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from mmp_cli.output import printable
from mmp_env.events import FastTracked, NodeExpanded, SearchStarted, SolutionFound
from mmp_env.wording import counted, in_seconds
from mmp_planners import Event

_REFRESH_S = 0.1
_Own = TypeVar("_Own", bound="_Line")


class _Line:
    """A line that disappears in the end. If `console` is not a terminal, there is none."""

    def __init__(self, text: str, console: Console) -> None:
        self._bar: Progress | None = None
        if console.is_terminal:
            columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
            self._bar = Progress(*columns, console=console, transient=True)
            self._task = self._bar.add_task(text, total=None)

    def __enter__(self: _Own) -> _Own:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar:
            self._bar.stop()

    def _write(self, text: str) -> None:
        if self._bar:
            self._bar.update(self._task, description=text)


class ScheduleLine(_Line):
    """The line of `mmp run`."""

    def __init__(self, planner: str, jobs: int, console: Console) -> None:
        self._begin = f"{printable(planner)}, {counted(jobs, 'job')}"
        super().__init__(f"{self._begin}: first schedule", console)

    def show(self, makespan_s: float) -> None:
        """Shows the makespan of the shortest schedule so far [s]."""
        self._write(f"{self._begin}: shortest schedule so far {in_seconds(makespan_s)}")


class ProgressLine(_Line):
    """The line of `mmp plan`, a watcher."""

    def __init__(self, planner: str, console: Console) -> None:
        self._planner = printable(planner)
        super().__init__(f"{self._planner}: first paths", console)
        self._restart, self._expanded, self._open, self._conflicts, self._tracked = 0, 0, 0, 0, 0
        self._cost_rad: float | None = None
        self._next_s = 0.0

    def __call__(self, event: Event) -> None:
        match event:
            case SearchStarted():
                self._restart = event.restart
            case NodeExpanded():
                self._expanded, self._open = event.expanded_nodes, event.open_nodes
                self._conflicts = event.conflicts
            case FastTracked():
                self._tracked += event.solved
            case SolutionFound():
                self._cost_rad = event.cost_rad
        now = time.monotonic()
        if now >= self._next_s:
            self._next_s = now + _REFRESH_S
            self._write(self.text())

    def text(self) -> str:
        """Returns the text of the line."""
        parts = [f"{self._expanded} nodes expanded, {self._open} open, {self._conflicts} conflicts in the last"]
        if self._restart:
            parts.append(f"restart {self._restart}")
        if self._tracked:
            parts.append(f"{self._tracked} fast-tracked")
        if self._cost_rad is not None:
            parts.append(f"best so far {self._cost_rad:.2f} rad")
        return f"{self._planner}: " + "; ".join(parts)
