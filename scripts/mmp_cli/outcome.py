"""The outcome of one run of `mmp plan`, as an exit code and as a line of results.jsonl."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mmp_cli.machine import machine, version
from mmp_cli.main import INTERRUPTED
from mmp_cli.output import shortened
from mmp_env.check import CheckReport
from mmp_env.files.writing import plain
from mmp_env.model.margins import KINDS
from mmp_env.model.problem import Problem
from mmp_env.retime import RetimeReport
from mmp_env.sim.execution import ExecutionReport
from mmp_planners import PlanResult, Status
from mmp_planners.result_validation import COUNTS

_RECORDED = ("times", "positions", "phases")


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """One run. Missing parts are None: an invalid instance has no problem, and without a plan there is no check.

    Attributes:
        asked: kind of margin -> metres that the user asked for.
        steps: which of `retime`, `out` and `execute` the user asked for.
        shown: row of the summary -> file of the picture, film, tree or recording.
        failures: sentences on files that could not be written, and on retiming or execution that failed.
    """

    instance: str
    planner: str
    seed: int
    result: PlanResult
    asked: Mapping[str, float] = field(default_factory=dict)
    steps: frozenset[str] = frozenset()
    problem: Problem | None = None
    planning_time_s: float | None = None
    interrupted: bool = False
    retimed: RetimeReport | None = None
    check: CheckReport | None = None
    check_time_s: float | None = None
    execution: ExecutionReport | None = None
    plan_path: str | None = None
    shown: Mapping[str, str] = field(default_factory=dict)
    failures: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """Returns 0 for a valid plan, executed without contact if asked; 1 otherwise; 2 for an invalid instance or an
        output that failed; 130 if interrupted.
        """
        if self.interrupted:
            return INTERRUPTED
        if self.result.status is Status.INVALID or (self.failures and not self.refuted):
            return 2
        valid = self.check is not None and self.check.valid
        executed = self.execution is None or (self.execution.reached and not self.execution.contacts)
        return 0 if valid and executed else 1

    @property
    def refuted(self) -> bool:
        """Whether the checker refutes a plan that its planner returned as solved."""
        return self.check is not None and not self.check.valid

    @property
    def message(self) -> str | None:
        """Returns what the planner did wrong if the status is `error`."""
        message = self.result.stats.get("message") if self.result.status is Status.ERROR else None
        return None if message is None else shortened(str(message))

    @property
    def interruption(self) -> str | None:
        """Returns a sentence on what Ctrl-C has left: the plan file and the steps it lacks. None if there was none."""
        if not self.interrupted:
            return None
        if self.plan_path is None:
            return "interrupted; no plan file was written" if "out" in self.steps else "interrupted"
        lacking = {
            "retimed": "retime" in self.steps and self.retimed is None,
            "checked": self.check is None,
            "executed": "execute" in self.steps and self.execution is None,
        }
        words = [f"not {word}" for word, is_lacking in lacking.items() if is_lacking]
        return f"interrupted; {self.plan_path} holds the plan, {', '.join(words) or 'checked'}"

    def failed(self, sentence: str) -> Outcome:
        """Returns this outcome with one more failure."""
        return dataclasses.replace(self, failures=(*self.failures, sentence))

    def line(self) -> dict[str, Any]:
        """Returns the fields of a line of results.jsonl as JSON values; missing values are null."""
        plan, stats = self.result.plan, self.result.stats
        return plain(
            {
                "instance": self.instance,
                "planner": self.planner,
                "seed": self.seed,
                "status": str(self.result.status),
                "planning_time_s": self.planning_time_s,
                "check_time_s": self.check_time_s,
                **{key: stats.get(key) for key in COUNTS},
                "cost_rad": plan.cost_rad if plan else None,
                "makespan_s": plan.makespan_s if plan else None,
                "root_conflicts": stats.get("root_conflicts"),
                "cost_lower_bound_rad": self.problem.cost_lower_bound_rad if self.problem else None,
                "min_clearance_m": self.check.min_clearance_m if self.check is not None else None,
                "margins_asked": {kind: self.asked.get(kind) for kind in KINDS},
                "margins_proved": self.check.proved_m if self.check is not None else None,
                "bound_met": stats.get("bound_met"),
                "deadline_hit": stats.get("deadline_hit"),
                "plan": self.plan_path,
                "version": version(),
                "machine": machine(),
            }
        )

    def verdict(self) -> dict[str, Any]:
        """Returns the further fields of `mmp plan --json`: `valid`, `message` of an error, `retimed`, `execution`."""
        out: dict[str, Any] = {"valid": self.check.valid if self.check is not None else None}
        if self.check is not None and self.check.may_touch:
            out["may_touch"] = [list(pair) for pair in self.check.may_touch]
        if self.message is not None:
            out["message"] = self.message
        if "retime" in self.steps:
            out["retimed"] = plain(dataclasses.asdict(self.retimed)) if self.retimed else None
        if "execute" in self.steps:
            out["execution"] = execution_fields(self.execution) if self.execution is not None else None
        return out


def execution_fields(report: ExecutionReport) -> dict[str, Any]:
    """Returns the report as JSON values, without the recorded motion."""
    fields = {field.name: getattr(report, field.name) for field in dataclasses.fields(report)}
    return plain({key: _values(value) for key, value in fields.items() if key not in _RECORDED})


def _values(value: Any) -> Any:
    """Returns dataclasses, also those in lists and mappings, as dicts."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    if isinstance(value, Mapping):
        return {key: _values(one) for key, one in value.items()}
    return [_values(one) for one in value] if isinstance(value, list) else value
