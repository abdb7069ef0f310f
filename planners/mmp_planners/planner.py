"""The interface of every planner: one signature, one kind of result."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from mmp_env.brief import brief
from mmp_env.events import Watcher, ignore
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem


@dataclass(frozen=True, kw_only=True)
class About:
    """Paper, guarantee and link of a planner: its class attribute `about`, for `mmp list` and the docs."""

    paper: str
    guarantee: str
    url: str | None = None


class StopPlanning(Exception):
    """Ends a run with the best plan so far. A watcher or a signal handler raises it."""


class Status(enum.StrEnum):
    """How a run ended; `advice` says what to do next."""

    SOLVED = "solved"
    TIMEOUT = "timeout"
    EXHAUSTED = "exhausted"
    INVALID = "invalid"
    ERROR = "error"

    @property
    def advice(self) -> str:
        """A sentence that tells the user what to do next."""
        return _ADVICE[self]


_ADVICE = {
    Status.SOLVED: "Check the plan with mmp_env.check_plan, and retime it before a robot follows it.",
    Status.TIMEOUT: "Give the planner more time, or try another seed or planner; a solution may exist.",
    Status.EXHAUSTED: "Try another seed or planner; a solution may exist, although the constraints ended this search.",
    Status.INVALID: "Change the start or the goal: one is out of limits, in collision, or closer than a margin.",
    Status.ERROR: "Report the fault to the authors of the planner, or try another planner.",
}
"""Status -> what the user can do next."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanResult:
    """Result of a run.

    Attributes:
        status: how the run ended.
        plan: the certified plan, or None unless the status is `solved`.
        stats: counts, costs [rad] and times [s] of the run, with the keys of `results.jsonl`.
    """

    status: Status
    plan: Plan | None = None
    stats: Mapping[str, Any] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        reason = f" ({self.stats['message']})" if self.stats.get("message") else ""
        return f"{self.status}{reason}: {'no plan' if self.plan is None else self.plan}"


@runtime_checkable
class Planner(Protocol):
    """A planner. Its options are its own fields."""

    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Plans a problem.

        Args:
            problem: the problem to solve.
            seed: seed of all random numbers. The same seed gives the same plan, unless the time limit is hit.
            time_limit: time limit [s].
            watch: watcher that gets the events of the run. It may raise `StopPlanning`.

        Returns:
            The result, with the best plan so far if the time limit is hit.

        Raises:
            MmpError: if an argument or option is not allowed.
        """
        ...
