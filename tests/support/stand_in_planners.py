"""Planners that do one thing each, for tests of programs that call planners. `install` registers them."""

from __future__ import annotations

import contextlib
import math
import signal
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint
from typing import ClassVar

import numpy as np

from mmp_env import plugins
from mmp_env.events import NodeExpanded, SolutionFound
from mmp_env.model.plan import Plan
from mmp_planners import PlanResult, Status, StopPlanning, ignore

GROUP = "mmp_env.planners"


def straight_plan(problem, planner, steps=4):
    """Returns a plan of straight lines, as fast as the slowest joint allows."""
    shares = np.linspace(0, 1, steps + 1)
    positions = {
        name: problem.start[name] + shares[:, None] * (problem.goal[name] - problem.start[name])
        for name in problem.cell.arm_names
    }
    longest = max(
        float((np.abs(problem.goal[name] - problem.start[name]) / problem.max_velocity[name]).max())
        for name in problem.cell.arm_names
    )
    return Plan(problem=problem, times=shares * 1.01 * longest, positions=positions, planner=planner)


@dataclass
class Straight:
    """Goes straight, through every obstacle.

    This is not part of the summary.
    """

    steps: int = field(default=4, metadata={"doc": "pieces of the line"})
    w: float = 1.5
    careful: bool = True
    word: str = "none"
    calls: ClassVar[list] = []

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        self.calls.append({"options": self, "seed": seed, "time_limit": time_limit, "problem": problem})
        watch(NodeExpanded(elapsed_s=0.0, node=0, open_nodes=0, expanded_nodes=1, conflicts=0))
        plan = straight_plan(problem, {"name": "straight", "options": {"w": self.w}, "seed": seed}, self.steps)
        watch(SolutionFound(elapsed_s=0.0, node=0, cost_rad=plan.cost_rad, clearance_m=0.01))
        return PlanResult(status=Status.SOLVED, plan=plan, stats={"expanded_nodes": 1, "bound_met": True})


@dataclass
class Liar:
    """Stops short of the goal and reports success."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        whole = straight_plan(problem, {"name": "liar"})
        positions = {name: rows[:-1] for name, rows in whole.positions.items()}
        return PlanResult(status=Status.SOLVED, plan=Plan(problem=problem, times=whole.times[:-1], positions=positions))


@dataclass
class Helpless:
    """Finds nothing."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        return PlanResult(status=Status.TIMEOUT, stats={"expanded_nodes": 17, "deadline_hit": True})


@dataclass
class Interrupted:
    """Is interrupted `times` times while it plans, and returns the best plan so far."""

    times: int = 1
    solved: bool = True

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        try:
            signal.raise_signal(signal.SIGINT)
        except StopPlanning:
            for _ in range(self.times - 1):
                signal.raise_signal(signal.SIGINT)
        if not self.solved:
            return PlanResult(status=Status.TIMEOUT)
        return PlanResult(status=Status.SOLVED, plan=straight_plan(problem, {"name": "interrupted"}))


@dataclass
class Deaf:
    """Loses the exception of the signal handler, as a callback would, and keeps emitting events."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        with contextlib.suppress(StopPlanning):
            signal.raise_signal(signal.SIGINT)
        watch(NodeExpanded(elapsed_s=0.0, node=0, open_nodes=0, expanded_nodes=1, conflicts=0))
        return PlanResult(status=Status.ERROR)


@dataclass
class Waiting:
    """Prints that it has begun, and waits for Ctrl-C."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        with contextlib.suppress(StopPlanning):
            print("waiting", flush=True)  # inside `try`, because the signal may come before the next line
            signal.pause()
        return PlanResult(status=Status.SOLVED, plan=straight_plan(problem, {"name": "waiting"}))


@dataclass
class Faulty:
    """Has a bug."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        raise RuntimeError("a bug")


@dataclass
class Sorry:
    """Raises an error with a message."""

    message: ClassVar[str] = "my\nfault"

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        return PlanResult(status=Status.ERROR, stats={"message": self.message})


_KINDS = (Straight, Liar, Helpless, Interrupted, Deaf, Waiting, Faulty, Sorry)
PLANNERS = {kind.__name__.lower(): kind for kind in _KINDS}


def install() -> None:
    """Adds these planners, and one that cannot be imported, to the registered planners."""
    find = plugins.entry_points
    points = [EntryPoint(name, f"{__name__}:{kind.__name__}", GROUP) for name, kind in PLANNERS.items()]
    points.append(EntryPoint("absent", "no_such_package:Planner", GROUP))
    plugins.entry_points = lambda *, group: [*find(group=group), *(points if group == GROUP else [])]
