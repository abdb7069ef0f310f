"""Plans all arms together from rest, with a planner of the registry, when no single arm can go on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mmp_env.errors import InvalidInstanceError
from mmp_env.model.goals import AnyOf, Goal, JointGoal, Stay
from mmp_env.problems.making import make_problem
from mmp_planners.planner import Planner
from mmp_planners.safe_plan import run_planner
from mmp_planners.work.timeline import Timeline
from mmp_planners.work.timing import Timing
from mmp_planners.work.yielding import Yielding

PLACES = 24
"""Number of random places that an arm without a goal may end at."""
TIME_SHARE = 0.5
"""Largest share of the time left for one plan of the group."""
LONGEST_S = 20.0
"""Longest time for one plan of the group [s], so that a schedule without a time limit ends too."""
OPTIONS = {"auto": {"rounds": 4}}
"""Planner -> its options: a group moves rarely and not far, so few rounds of improvement pay."""


class Together:
    """Plans groups and commits their motions.

    Args:
        name: name of the planner.
        planner: the planner.
        timeline: the committed motions.
        timing: times the motions.
        yielding: knows places for arms without a goal.

    Attributes:
        plans: number of plans so far.
    """

    def __init__(self, name: str, planner: Planner, timeline: Timeline, timing: Timing, yielding: Yielding) -> None:
        self._name, self._planner, self._timeline = name, planner, timeline
        self._timing, self._yielding = timing, yielding
        self.plans = 0

    def move(self, goals: Mapping[int, Goal], seed: int, time_limit: float) -> int | None:
        """Moves some arms to their goals and the others where they leave room, all from rest and on one clock.

        Returns:
            The period at which all begin; None if no plan was found.
        """
        timeline, problem = self._timeline, self._timeline.problem
        start = {name: timeline.rest(arm) for arm, name in enumerate(timeline.names)}
        asked = {name: goals[arm] if arm in goals else self._aside(arm) for arm, name in enumerate(timeline.names)}
        try:
            together = make_problem(
                problem.cell, start, asked, max_velocity=problem.max_velocity, margin=problem.margins
            )
        except InvalidInstanceError:
            return None
        self.plans += 1
        result = run_planner(
            self._name, self._planner, together, seed=seed, time_limit=min(LONGEST_S, TIME_SHARE * time_limit)
        )
        if result.plan is None:
            return None
        samples = self._timing.together(result.plan.times, result.plan.positions)
        return None if samples is None else timeline.append_together(samples)

    def _aside(self, arm: int) -> Goal:
        places: Float[np.ndarray, "m dof"] = self._yielding.places(arm, PLACES)
        return AnyOf([Stay(), *map(JointGoal, places)])
