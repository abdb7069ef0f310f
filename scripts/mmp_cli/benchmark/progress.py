"""Progress of a benchmark and the remaining time: a bar on a terminal, otherwise a line every few seconds."""

from __future__ import annotations

import statistics
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from mmp_cli.benchmark.job import Unit

PLAIN_EVERY_S = 10.0


class BenchProgress:
    """A context manager. `lines` are the results of an earlier start, `units` those still to run."""

    def __init__(
        self, units: Sequence[Unit], lines: Iterable[Mapping[str, Any]], workers: int, console: Console
    ) -> None:
        self._left = Counter(unit.planner for unit in units)
        self._all, self._workers, self._console = len(units), workers, console
        self._spent: defaultdict[str, list[float]] = defaultdict(list)
        self._statuses: Counter[str] = Counter()
        for line in lines:
            self._note(line)
        self._before = self._statuses.total()
        self._next_s = 0.0
        self._bar: Progress | None = None
        if console.is_terminal:
            columns = (
                BarColumn(),
                MofNCompleteColumn(),
                TimeElapsedColumn(),
                TextColumn("{task.description}", markup=False),
            )
            self._bar = Progress(*columns, console=console, transient=True)
            self._task = self._bar.add_task("starting", total=self._before + self._all, completed=self._before)

    def __enter__(self) -> BenchProgress:
        if self._bar:
            self._bar.start()
        elif self._all:
            there = f"{self._before} results are there, " if self._before else ""
            self._print(f"{there}{self._all} to come, {self._workers} at a time")
        self._next_s = time.monotonic() + PLAIN_EVERY_S
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar:
            self._bar.stop()
        elif self._all:
            self._print(self._line())

    def done(self, unit: Unit, line: Mapping[str, Any]) -> None:
        """Counts a result."""
        self._left[unit.planner] -= 1
        self._note(line)
        if self._bar:
            self._bar.update(self._task, advance=1, description=self.text())
        elif time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + PLAIN_EVERY_S
            self._print(self._line())

    def left_s(self) -> float | None:
        """Returns the remaining time [s] from the mean time of each planner; None before the first result."""
        known = {planner: statistics.mean(times) for planner, times in self._spent.items()}
        if not known:
            return None
        middle = statistics.mean(known.values())
        return sum(known.get(planner, middle) * count for planner, count in self._left.items()) / self._workers

    def text(self) -> str:
        """Returns the remaining time and the counts by status."""
        left = self.left_s() if self._left.total() else None
        ends = ", ".join(f"{count} {status}" for status, count in sorted(self._statuses.items()))
        return "; ".join(part for part in (f"about {duration(left)} left" if left is not None else "", ends) if part)

    def _line(self) -> str:
        done = self._statuses.total()
        return f"{done} of {self._before + self._all} done; {self.text()}".removesuffix("; ")

    def _note(self, line: Mapping[str, Any]) -> None:
        times = [line.get(key) for key in ("planning_time_s", "check_time_s")]
        known = [t for t in times if isinstance(t, int | float)]
        if known:
            self._spent[line["planner"]].append(sum(known))
        self._statuses[line["status"]] += 1

    def _print(self, text: str) -> None:
        print(f"mmp bench: {text}", file=self._console.file, flush=True)


def duration(seconds: float) -> str:
    """Returns a duration as text: `40 s`, `12 min`, `3 h 20 min`."""
    whole = round(seconds)
    if whole < 100:
        return f"{whole} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
