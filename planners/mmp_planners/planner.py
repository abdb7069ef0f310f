"""What every planner is: one signature, one kind of result."""

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
    """Where a planner comes from and what it promises: the class attribute `about`, for `mmp list` and the docs."""

    paper: str
    guarantee: str
    url: str | None = None


class StopPlanning(Exception):
    """Raised by a watcher, or by a signal handler: ends the run with the best plan so far."""


class Status(enum.StrEnum):
    """How a run ended. `exhausted`: the constraints used up the search; nothing is proved by that."""

    SOLVED = "solved"
    TIMEOUT = "timeout"
    EXHAUSTED = "exhausted"
    INVALID = "invalid"
    ERROR = "error"


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanResult:
    """A plan, or why there is none, and counts and times of the run (keys as in `results.jsonl`)."""

    status: Status
    plan: Plan | None = None
    stats: Mapping[str, Any] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        reason = f" ({self.stats['message']})" if self.stats.get("message") else ""
        return f"{self.status}{reason}: {'no plan' if self.plan is None else self.plan}"


@runtime_checkable
class Planner(Protocol):
    """Options are the fields of the planner itself; `plan` takes the problem and nothing else to tune."""

    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Plans `problem` within `time_limit` [s]. The same seed gives the same plan unless the limit is hit."""
        ...
