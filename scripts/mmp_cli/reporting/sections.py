"""Sections of the report, one per cell, with the runs of each planner."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from mmp_cli.reporting.results import Line
from mmp_cli.reporting.statistics import Spread, spread
from mmp_env.model.margins import KINDS

Problem = tuple[str, int]
"""Instance and seed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannerRuns:
    """Results of one planner in one cell. Each line is invalid, solved or unsolved."""

    label: str
    lines: tuple[Line, ...]

    @cached_property
    def valid(self) -> tuple[Line, ...]:
        """Returns the lines that count: all except invalid instances."""
        return tuple(line for line in self.lines if line.status != "invalid")

    @cached_property
    def solved(self) -> tuple[Line, ...]:
        return tuple(line for line in self.lines if line.status == "solved")

    @cached_property
    def unsolved(self) -> tuple[Line, ...]:
        """Returns the lines with a timeout, an exhausted search or an error."""
        return tuple(line for line in self.valid if line.status != "solved")

    @cached_property
    def errors(self) -> tuple[Line, ...]:
        return tuple(line for line in self.lines if line.status == "error")

    @cached_property
    def by_problem(self) -> dict[Problem, Line]:
        """Returns the solved lines by problem."""
        return {line.problem: line for line in self.solved}

    @cached_property
    def asked(self) -> tuple[str, ...]:
        """Returns the kinds of margins that were asked for, if every plan has a proof by kind."""
        if any(line.margins_proved is None for line in self.solved):
            return ()
        return tuple(kind for kind in KINDS if any(getattr(line.margins_asked, kind, None) for line in self.solved))

    def proved_m(self, kind: str | None) -> float | None:
        """Returns the least clearance of a kind that the checker proved for the plans; None means all kinds."""
        lines = self.solved
        values = [line.min_clearance_m if kind is None else getattr(line.margins_proved, kind, None) for line in lines]
        return min((value for value in values if value is not None), default=None)

    def spread(self, field: str, *, among: Iterable[Problem] | None = None) -> Spread | None:
        """Returns the spread of a field over the solved lines, or over those of the problems `among`."""
        lines = self.solved if among is None else [self.by_problem[problem] for problem in among]
        return spread(getattr(line, field) for line in lines)


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """One cell with all its runs; planners in the order of the settings, or else of the file."""

    name: str
    arms: int | None
    runs: tuple[PlannerRuns, ...]

    @cached_property
    def instances(self) -> tuple[str, ...]:
        """Returns every instance with a run, in the order of the file."""
        return tuple(dict.fromkeys(line.instance for run in self.runs for line in run.lines))

    @cached_property
    def seeds(self) -> dict[str, set[int]]:
        """Returns instance -> seeds of its runs."""
        out: dict[str, set[int]] = {}
        for run in self.runs:
            for line in run.lines:
                out.setdefault(line.instance, set()).add(line.seed)
        return out

    @cached_property
    def invalid(self) -> dict[str, str]:
        """Returns instances whose start or goal breaks a limit or a margin -> the reason, if known."""
        lines = [line for run in self.runs for line in run.lines if line.status == "invalid"]
        why = {line.instance: line.message for line in lines if line.message}
        return {line.instance: why.get(line.instance, "") for line in lines}

    @cached_property
    def lower_bounds(self) -> dict[str, float]:
        """Returns instance -> cost of the straight lines from start to goal [rad], if known."""
        lines = (line for run in self.runs for line in run.lines)
        return {line.instance: x for line in lines if (x := line.cost_lower_bound_rad) is not None}

    @cached_property
    def solved_by_none(self) -> tuple[str, ...]:
        """Returns the valid instances that no planner has solved with any seed."""
        solved = {line.instance for run in self.runs for line in run.solved} | set(self.invalid)
        return tuple(name for name in self.instances if name not in solved)

    @cached_property
    def successful(self) -> tuple[PlannerRuns, ...]:
        """Returns the planners that have solved an instance."""
        return tuple(run for run in self.runs if run.solved)

    @cached_property
    def common(self) -> tuple[Problem, ...]:
        """Returns the problems that all successful planners have solved; none for fewer than two planners."""
        if len(self.successful) < 2:
            return ()
        return commonly_solved(self.successful)

    @cached_property
    def root_conflicts(self) -> tuple[float, ...]:
        """Returns the mean number of root conflicts of each valid problem, over the planners that count them."""
        counts: dict[Problem, list[float]] = {}
        for run in self.runs:
            for line in run.valid:
                if line.root_conflicts is not None:
                    counts.setdefault(line.problem, []).append(line.root_conflicts)
        return tuple(sum(values) / len(values) for values in counts.values())


def commonly_solved(runs: Iterable[PlannerRuns]) -> tuple[Problem, ...]:
    """Returns the problems that all of them have solved, in the order of the first."""
    first, *others = runs
    return tuple(problem for problem in first.by_problem if all(problem in run.by_problem for run in others))


def sections(lines: Iterable[Line], order: Iterable[str] = ()) -> tuple[Section, ...]:
    """Returns the sections by cell; planners in `order` come first, the others as they occur."""
    cells: dict[str, list[Line]] = {}
    for line in lines:
        cells.setdefault(line.section, []).append(line)
    ranks = {label: rank for rank, label in enumerate(order)}
    out = []
    for name, held in cells.items():
        labels = sorted(dict.fromkeys(line.planner for line in held), key=lambda x: ranks.get(x, len(ranks)))
        runs = [PlannerRuns(label=x, lines=tuple(line for line in held if line.planner == x)) for x in labels]
        arms = next((line.arms for line in held if line.arms is not None), None)
        out.append(Section(name=name, arms=arms, runs=tuple(runs)))
    return tuple(out)
