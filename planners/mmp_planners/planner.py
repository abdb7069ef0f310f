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
    """How a run ended. `exhausted`: the constraints used up the search; nothing is proved by that."""

    SOLVED = "solved"
    TIMEOUT = "timeout"
    EXHAUSTED = "exhausted"
    INVALID = "invalid"
    ERROR = "error"


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
