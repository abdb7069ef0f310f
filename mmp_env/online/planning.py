"""Plans a path among bodies: each is an obstacle, grown by what it may move meanwhile."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import text, whole
from mmp_env.errors import InvalidInstanceError
from mmp_env.model.cell import Cell
from mmp_env.model.goals import GivenGoal
from mmp_env.model.margins import Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.online.bodies import MovingBody, grown
from mmp_env.online.budget import Budget
from mmp_env.online.motion import OnlineMotion
from mmp_env.plugins import PLANNERS
from mmp_env.problems.making import make_problem
from mmp_env.retime import RetimeOptions
from mmp_env.retime.retiming import retime_unproved
from mmp_env.retime.steps import Steps

State = Mapping[str, Float[np.ndarray, "_dof"]]
AHEAD_S = 0.5
"""Bodies are planned around as if they had moved for so long [s]."""
RATE_HZ = 50.0
"""Samples of a motion per second [Hz]."""
AT_GOAL = "the arms are at their goals"
"""Reason not to plan."""
_TRIES = 3
"""Tries to find room for bodies; each makes them grow half as much."""
_GUESS_S = 0.005
"""First guess of the time to retime a path [s]."""
_MORE, _FADE = 1.3, 0.8
"""Factor of the longest of the last times, and how it fades."""
_PROOF_S = 0.003
"""Time that is left to prove the begin of a motion [s]."""
_LEAST_S = 0.003
"""Least time for which the planner is called [s]; some are late by so much."""
_STEP_S = 0.002
"""First guess of the time of a step of this, and of making a problem [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Wanted:
    """What motions lead to: goals as a user gave them."""

    goal: Mapping[str, GivenGoal]

    def is_same(self, goal: Mapping[str, GivenGoal]) -> bool:
        """Returns whether other goals are the same ones."""
        return self.goal.keys() == goal.keys() and all(_same(self.goal[name], goal[name]) for name in goal)


@dataclass(eq=False)
class _Work:
    """A path that is being timed: `steps` lead to its motion."""

    wanted: Wanted
    plan: Plan
    steps: Steps[OnlineMotion]
    seconds: float = 0.0


class PathPlanner:
    """Plans paths from rest to rest with a planner, and times them.

    Args:
        planner: name of the planner.
        seed: seed of its first call.
        max_velocity: [rad/s], as in `make_problem`.
        margins: margins of all problems [m].
        options: options of retiming.
    """

    def __init__(self, planner: str, seed: int, max_velocity: Any, margins: Margins, options: RetimeOptions) -> None:
        self._planner, self._seed = PLANNERS.load(text("planner", planner))(), whole("seed", seed, 0)
        self.max_velocity, self._margins, self._options = max_velocity, margins, options
        self._last_s, self._step_s, self._problem_s = _GUESS_S, _STEP_S, _STEP_S
        self._work: _Work | None = None
        self._kept: OnlineMotion | None = None

    def motion(
        self,
        cell: Cell,
        start: State,
        wanted: Wanted,
        bodies: Iterable[MovingBody],
        budget: Budget,
        waiting: frozenset[str] = frozenset(),
    ) -> tuple[OnlineMotion | None, str]:
        """Returns a timed motion that is not proved, in which the arms `waiting` stand, or None and the reason.

        A path that is not timed when the time is up is timed in the next call with the same start and goals.
        """
        kept, self._kept = self._kept, None
        if kept is not None and kept.goal is wanted.goal and _starts_at(kept.plan, start):
            return kept, ""
        work = self._work
        if work is None or work.wanted is not wanted or not _starts_at(work.plan, start):
            goal = {**wanted.goal, **{name: start[name] for name in waiting}}
            plan, reason = self._path(cell, start, goal, tuple(bodies), budget)
            if plan is None:
                return None, reason
            work = self._work = _Work(wanted, plan, self._steps(plan, wanted, waiting))
        motion = self._advanced(work, budget)
        return motion, "" if motion is not None else "no time to retime the plan"

    def keep(self, motion: OnlineMotion) -> None:
        """Keeps a motion that could not be proved in time, for the next call with the same start and goals."""
        self._kept = motion

    def check(self, cell: Cell, start: State, goal: Mapping[str, GivenGoal]) -> None:
        """Raises what `make_problem` raises for goals that cannot be reached even without bodies."""
        make_problem(cell, start, goal, max_velocity=self.max_velocity, margin=self._margins)

    def _path(
        self, cell: Cell, start: State, goal: Mapping[str, GivenGoal], bodies: tuple[MovingBody, ...], budget: Budget
    ) -> tuple[Plan | None, str]:
        """Returns a path to the goals, or None and the reason."""
        problem, reason = self._problem(cell, start, goal, bodies, budget)
        if problem is None:
            return None, reason
        if budget.left_s < _LEAST_S:
            return None, "no time to plan"
        seconds = max(budget.left_s - self._timing_s, budget.left_s / 2)
        plan = self._planner.plan(problem, seed=self._seed, time_limit=seconds).plan
        self._seed += 1
        if plan is None:
            return None, "no plan found in time"
        return (plan, "") if plan.cost_rad else (None, AT_GOAL)

    def _problem(
        self, cell: Cell, start: State, goal: Mapping[str, GivenGoal], bodies: tuple[MovingBody, ...], budget: Budget
    ) -> tuple[Problem | None, str]:
        """Returns the problem among grown bodies, or None and the reason."""
        solids = [(body.solid, body.speed * AHEAD_S) for body in bodies]
        for k in range(_TRIES):
            share = 0.5**k if k < _TRIES - 1 else 0.0
            if budget.left_s < _MORE * self._problem_s + _LEAST_S:
                self._problem_s *= _FADE
                return None, "no time to plan"
            began = time.perf_counter()
            among = replace(cell, obstacles=(*cell.obstacles, *(grown(solid, share * by) for solid, by in solids)))
            try:
                problem = make_problem(among, start, goal, max_velocity=self.max_velocity, margin=self._margins)
                return problem, ""
            except InvalidInstanceError:
                if not bodies:
                    raise
            finally:
                self._problem_s = max(_FADE * self._problem_s, time.perf_counter() - began)
        return None, "start or goal is too close to a body"

    def _steps(self, plan: Plan, wanted: Wanted, waiting: frozenset[str]) -> Steps[OnlineMotion]:
        motion = yield from retime_unproved(plan, self._options)
        yield
        return OnlineMotion(motion, wanted.goal, waiting)

    def _advanced(self, work: _Work, budget: Budget) -> OnlineMotion | None:
        """Takes the next steps of the work. Returns the motion, or None if it is not ready when the time is up."""
        began = step = time.perf_counter()
        try:
            while budget.left_s > _MORE * self._step_s:
                next(work.steps)
                now = time.perf_counter()
                self._step_s, step = max(_FADE * self._step_s, now - step), now
        except StopIteration as end:
            self._work = None
            self._last_s = max(_FADE * self._last_s, work.seconds + time.perf_counter() - began)
            return end.value
        self._step_s *= _FADE  # a step that was slow once must not stop all later ones
        work.seconds += time.perf_counter() - began
        return None

    @property
    def _timing_s(self) -> float:
        """How long it will probably take to retime a plan, and to prove its begin [s]."""
        return _MORE * self._last_s + _PROOF_S


def _starts_at(plan: Plan, start: State) -> bool:
    return all(np.array_equal(plan.problem.start[name], q) for name, q in start.items())


def _same(a: object, b: object) -> bool:
    if isinstance(a, (str, Mapping)) or isinstance(b, (str, Mapping)):
        return a == b
    if hasattr(a, "__dict__") or hasattr(b, "__dict__"):
        return a is b or (type(a) is type(b) and repr(a) == repr(b))
    return np.array_equal(np.asarray(a), np.asarray(b))
