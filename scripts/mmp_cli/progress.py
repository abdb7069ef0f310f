"""The progress lines of `mmp plan` and `mmp run`, which show the state of the planning on the terminal."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from mmp_cli.output import printable
from mmp_env.events import FastTracked, NodeExpanded, SearchStarted, SolutionFound
from mmp_env.wording import counted, in_seconds
from mmp_planners import Event

_REFRESH_S = 0.1


class _Line:
    """A line that disappears when it stops. If `console` is not a terminal, there is none."""

    def __init__(self, text: str, console: Console) -> None:
        self._bar: Progress | None = None
        if console.is_terminal:
            columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
            self._bar = Progress(*columns, console=console, transient=True)
            self._task = self._bar.add_task(text, total=None)

    def start(self) -> None:
        if self._bar:
            self._bar.start()

    def stop(self) -> None:
        if self._bar:
            self._bar.stop()

    def show(self, text: str) -> None:
        if self._bar:
            self._bar.update(self._task, description=text)


class ScheduleLine:
    """The line of `mmp run`."""

    def __init__(self, planner: str, jobs: int, console: Console) -> None:
        self._begin = f"{printable(planner)}, {counted(jobs, 'job')}"
        self._line = _Line(f"{self._begin}: first schedule", console)

    def __enter__(self) -> ScheduleLine:
        self._line.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._line.stop()

    def show(self, makespan_s: float) -> None:
        """Shows the makespan of the shortest schedule so far [s]."""
        self._line.show(f"{self._begin}: shortest schedule so far {in_seconds(makespan_s)}")


class ProgressLine:
    """The line of `mmp plan`, a watcher."""

    def __init__(self, planner: str, console: Console) -> None:
        self._planner = printable(planner)
        self._line = _Line(f"{self._planner}: first paths", console)
        self._restart, self._expanded, self._open, self._conflicts, self._tracked = 0, 0, 0, 0, 0
        self._cost_rad: float | None = None
        self._next_s = 0.0

    def __enter__(self) -> ProgressLine:
        self._line.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._line.stop()

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
            self._line.show(self.text())

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
