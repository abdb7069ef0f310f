"""RRT-Connect for growing groups of arms, after subdimensional expansion: Wagner, Kang, Choset: Probabilistic path
planning for multiple robots with subdimensional expansion, ICRA 2012.

Guarantee: none. Groups are small, and a group keeps the path that it found. No bound on the cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from mmp_env import core
from mmp_env.argument_checks import known_keywords
from mmp_env.events import SearchStarted, Watcher, ignore
from mmp_env.model.problem import Problem
from mmp_planners.goal_combinations import goal_combinations
from mmp_planners.options import GRID_STEP_S, check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.portfolio.improve import emit_and_shorten
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.search_levels import search_levels
from mmp_planners.portfolio.shortcutting import retime_all_joints
from mmp_planners.portfolio.turns import Turn
from mmp_planners.portfolio.wait_removal import waits_option
from mmp_planners.rrt_connect import SETTINGS
from mmp_planners.seeds import sub_seeds

ITERATIONS_PER_ARM = 500
"""Number of iterations of the first attempt for each arm. Every other attempt has twice as many as the one before."""
TURN = 100
"""Number of iterations of one turn."""
STEP_WORK = 15.0
"""Work of one step, about its microseconds."""
ITERATION_WORK = 10.0
"""Work of one iteration beside its steps."""


@dataclass(frozen=True, kw_only=True)
class GroupRrt:
    """Moves every arm straight if possible. Plans the others alone among standing arms, or with arms that block them.

    Where the search for a group fails, the standing arm that blocked it most often joins it
    (`native/joint_space/group_search.hpp`). Each attempt takes the next combination of candidates as its goal.
    """

    about: ClassVar[About] = About(
        paper="Wagner, Kang, Choset: Probabilistic path planning for multiple robots with subdimensional expansion, "
        "ICRA 2012 (here one group after the other)",
        url="https://doi.org/10.1109/ICRA.2012.6225297",
        guarantee="neither complete (groups are small, and keep the paths that they found) nor bounded in cost",
    )

    range: float = option(SETTINGS.range, "longest move of an arm on an edge, L2 [rad]", least=0.01)
    step: float = option(SETTINGS.step, "distance between samples of an edge, largest joint [rad]", least=0.001)
    most: int = option(8, "largest number of arms in a group", least=1)
    shorten: int = option(200, "attempts to shorten the plan on the common clock; 0: keep it as found", least=0)
    waits: str = waits_option()
    dt: float = option(GRID_STEP_S, "step of the time grid of the shortcuts [s]", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Plans a problem. Arguments and result are those of `Planner.plan`."""
        run = Run.begin("group-rrt", self, problem, seed, time_limit, removes_waits=self.waits == "removed")
        check_steps(problem, self.dt)
        try:
            for _ in self.turns(run, watch):
                pass
            emit_and_shorten(run, watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result()

    def turns(self, run: Run, watch: Watcher = ignore) -> Iterator[Turn]:
        """Yields after each turn; ends with a plan, or without time. The watcher gets the begin of each attempt."""
        problem, limit = run.problem, ITERATIONS_PER_ARM * len(run.problem.start)
        goals = goal_combinations(problem, run.seed)
        for attempt, sub_seed in enumerate(sub_seeds(run.seed)):
            watch(SearchStarted(elapsed_s=run.elapsed_s, restart=attempt, sub_seed=sub_seed))
            search = core.GroupSearch(
                problem.cell.collision.core,
                start=problem.joint_start,
                goal=goals[attempt % len(goals)],
                **search_levels(problem),
                seed=sub_seed,
                settings=core.CompositeSettings(range=self.range, step=self.step),
                most=self.most,
            )
            steps = iterations = 0
            while search.iterations < limit << attempt // 2:
                path = search.grow(TURN, run.clock)
                if run.clock.expired or (path is not None and run.offer(retime_all_joints(problem, path))):
                    return
                # The proof of the path failed, or every arm that is left blocks too many others.
                if path is not None or search.steps == steps:
                    break
                yield Turn(STEP_WORK * (search.steps - steps) + ITERATION_WORK * (search.iterations - iterations))
                steps, iterations = search.steps, search.iterations
            run.counts.restarts += 1
            work = STEP_WORK * (search.steps - steps) + ITERATION_WORK * (search.iterations - iterations)
            yield Turn(work, failed=True)
