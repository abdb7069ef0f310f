"""A line of `results.jsonl`: its fields with their types and bounds, and writing one."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import msgspec

from mmp_cli.benchmark.job import Failure, Job, Unit
from mmp_cli.outcome import Outcome
from mmp_cli.output import shortened
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.reading import Location, decode, parse_json
from mmp_env.model.margins import KINDS, asked_margins
from mmp_planners import PlanResult, Status

LARGEST = 1e12
"""Largest number in a result, of any unit; sums and products of such numbers stay finite."""
LONGEST_TEXT = 10_000
"""Largest number of characters in a field."""
_SAME_RAD = 1e-9


class ByKind(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Lengths [m] by kind of margin, see `mmp_env.model.margins`; None if there is none."""

    arms: float | None = None
    obstacles: float | None = None
    self: float | None = None


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One line. Values that do not exist, or that the planner does not count, are None. `planner` is the label.

    `workers` is the number of runs at a time, and `load` the load of the machine over the last minute of the run.

    A line without generated nodes has no conflict tree, and so no expanded nodes.
    """

    instance: str
    planner: str
    status: str
    seed: int = 0
    cell: str | None = None
    arms: int | None = None
    planning_time_s: float | None = None
    check_time_s: float | None = None
    expanded_nodes: float | None = None
    generated_nodes: float | None = None
    low_level_calls: float | None = None
    fast_track_tries: float | None = None
    fast_track_hits: float | None = None
    cost_rad: float | None = None
    makespan_s: float | None = None
    root_conflicts: float | None = None
    cost_lower_bound_rad: float | None = None
    min_clearance_m: float | None = None
    margins_asked: ByKind | None = None
    margins_proved: ByKind | None = None
    bound_met: bool | None = None
    deadline_hit: bool | None = None
    message: str | None = None
    plan: str | None = None
    version: str | None = None
    machine: str | None = None
    workers: float | None = None
    load: float | None = None

    @property
    def source(self) -> str:
        """Returns the name of the cell or the environment id: the instance up to its first slash."""
        return self.instance.partition("/")[0]

    @property
    def section(self) -> str:
        """Returns the section of the report that the line belongs to."""
        return self.cell or self.source

    @property
    def problem(self) -> tuple[str, int]:
        """Returns instance and seed, on which planners are compared."""
        return self.instance, self.seed

    @property
    def cost_ratio(self) -> float | None:
        """Returns the cost relative to the straight lines; None without a plan, or if start and goal are the same."""
        if self.cost_rad is None or self.cost_lower_bound_rad is None or self.cost_lower_bound_rad < _SAME_RAD:
            return None
        return self.cost_rad / self.cost_lower_bound_rad


_NUMBERS = tuple(f.name for f in msgspec.structs.fields(Line) if f.type == float | None)
_TEXTS = tuple(f.name for f in msgspec.structs.fields(Line) if f.type in (str, str | None))


def read_line(row: str, place: Location) -> Line:
    """Returns the result in a line. Raises `MmpError` that names file, line and field."""
    data = parse_json(row, place)
    if not isinstance(data, dict):
        raise place.wrong(data, "an object")
    line = decode(data, Line, place)
    if line.status not in list(Status):
        raise MmpError(f"{place}: {UnknownNameError('status', line.status, Status)}")
    for name in _NUMBERS:
        _check_number(getattr(line, name), place / name, -LARGEST if name == "min_clearance_m" else 0)
    for name in ("margins_asked", "margins_proved"):
        for kind in KINDS:
            _check_number(getattr(getattr(line, name), kind, None), place / name / kind, -LARGEST)
    if line.arms is not None and not 1 <= line.arms <= LARGEST:
        raise (place / "arms").wrong(line.arms, f"a whole number from 1 to {LARGEST:g}, or null")
    for name in _TEXTS:
        if len(getattr(line, name) or "") > LONGEST_TEXT:
            raise (place / name).wrong(getattr(line, name), f"at most {LONGEST_TEXT} characters")
    return msgspec.structs.replace(line, expanded_nodes=None) if line.generated_nodes == 0 else line


def _check_number(value: float | None, place: Location, least: float) -> None:
    if value is not None and not (math.isfinite(value) and least <= value <= LARGEST):
        raise place.wrong(value, f"a finite number from {least:g} to {LARGEST:g}, or null")


def line_of(job: Job, unit: Unit, outcome: Outcome, message: str | None = None) -> dict[str, Any]:
    """Returns the line of a unit; `message` explains a status that does not explain itself."""
    source = job.sources[unit.source]
    text = None if message is None else shortened(" ".join(message.split()))
    outcome = replace(outcome, asked=asked_margins(source.margin))
    return outcome.line() | {"cell": source.title, "arms": len(source.cell.arms), "message": text}


def line_of_failure(job: Job, unit: Unit, failure: Failure) -> dict[str, Any]:
    """Returns the line of a unit whose worker ended."""
    outcome = Outcome(
        instance=unit.instance, planner=unit.planner, seed=unit.seed, result=PlanResult(status=Status.ERROR)
    )
    return line_of(job, unit, outcome, failure.message) | {"machine": failure.machine}
