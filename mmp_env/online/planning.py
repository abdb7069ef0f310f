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
from mmp_env.online.bodies import MovingBody, grown
from mmp_env.plugins import PLANNERS
from mmp_env.problems.making import make_problem
from mmp_env.retime import RetimeOptions
from mmp_env.retime.retiming import retime_unproved

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
_RESERVE_S = 0.0015
"""Time that is left at the end of a call for its last steps [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Wanted:
    """What motions lead to: goals as a user gave them."""

    goal: Mapping[str, GivenGoal]

    def is_same(self, goal: Mapping[str, GivenGoal]) -> bool:
        """Returns whether other goals are the same ones."""
        return self.goal.keys() == goal.keys() and all(_same(self.goal[name], goal[name]) for name in goal)


class Budget:
    """The time of one call."""

    def __init__(self, seconds: float) -> None:
        self._end = time.perf_counter() + seconds - _RESERVE_S

    @property
    def left_s(self) -> float:
        """What is left [s], 0 or more."""
        return max(self._end - time.perf_counter(), 0.0)


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
        self._last_s = _GUESS_S
        self._found: tuple[Wanted, Plan] | None = None  # a path that is still to be timed

    def motion(
        self, cell: Cell, start: State, wanted: Wanted, bodies: Iterable[MovingBody], budget: Budget
    ) -> tuple[Plan | None, str]:
        """Returns a timed motion that is not proved, or None and the reason.

        A path that was found too late to be timed is kept for the next call with the same start and goals.
        """
        (meant, plan), self._found = self._found or (None, None), None
        if plan is None or meant is not wanted or not _starts_at(plan, start):
            problem = self._problem(cell, start, wanted, tuple(bodies))
            if problem is None:
                return None, "start or goal is too close to a body"
            seconds = max(budget.left_s - self._timing_s, budget.left_s / 2)
            plan = self._planner.plan(problem, seed=self._seed, time_limit=seconds).plan
            self._seed += 1
            if plan is None:
                return None, "no plan found in time"
        if plan.cost_rad == 0:
            return None, AT_GOAL
        if budget.left_s < self._timing_s:
            self._found = wanted, plan
            self._last_s *= _FADE  # a time that was measured once must not keep a path from being timed for ever
            return None, "no time to retime the plan"
        began = time.perf_counter()
        motion = retime_unproved(plan, self._options)
        self._last_s = max(_FADE * self._last_s, time.perf_counter() - began)
        return motion, ""

    def check(self, cell: Cell, start: State, goal: Mapping[str, GivenGoal]) -> None:
        """Raises what `make_problem` raises for goals that cannot be reached even without bodies."""
        make_problem(cell, start, goal, max_velocity=self.max_velocity, margin=self._margins)

    def _problem(self, cell: Cell, start: State, wanted: Wanted, bodies: tuple[MovingBody, ...]) -> Any:
        solids = [(body.solid, body.speed * AHEAD_S) for body in bodies]
        for k in range(_TRIES):
            share = 0.5**k if k < _TRIES - 1 else 0.0
            among = replace(cell, obstacles=(*cell.obstacles, *(grown(solid, share * by) for solid, by in solids)))
            try:
                return make_problem(among, start, wanted.goal, max_velocity=self.max_velocity, margin=self._margins)
            except InvalidInstanceError:
                if not bodies:
                    raise
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
