"""RRT-Connect: Kuffner, LaValle: RRT-Connect: An efficient approach to single-query path planning, ICRA 2000; here in
the composite space of all arms.

Guarantee: probabilistically complete, up to the margin and the step between samples. No bound on the cost.
"""

from __future__ import annotations

import math
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
from mmp_planners.seeds import sub_seeds

SETTINGS = core.CompositeSettings()
"""Default lengths of an edge, and of the steps along it."""
NODES = 200_000
"""Largest number of nodes of both trees before a restart."""
SLICE = 200
"""Number of iterations between two checks of the number of nodes."""


@dataclass(frozen=True, kw_only=True)
class RrtConnect:
    """RRT-Connect over all joints of all arms at once: a fast and long first plan, then shortcuts.

    On an edge each arm moves by at most `range` [rad, L2], tested every `step` [rad]. Arms that would meet move one
    after the other, and a blocked arm does not hold up the others. A path that joins the trees is straightened, its
    corners are cut, and it is proved at every instant. Edges without a proof are removed, and the trees grow on. The
    tree of the goals has one root per combination of the arms' candidates (`goal_combinations`).
    """

    about: ClassVar[About] = About(
        paper="Kuffner, LaValle: RRT-Connect: An efficient approach to single-query path planning, ICRA 2000",
        url="https://doi.org/10.1109/ROBOT.2000.844730",
        guarantee="probabilistically complete, up to the margin and the step between samples; no bound on the cost",
    )

    range: float = option(SETTINGS.range, "longest move of an arm on an edge of the trees, L2 [rad]", least=0.01)
    step: float = option(SETTINGS.step, "distance between samples of an edge, largest joint [rad]", least=0.001)
    nodes: int = option(NODES, "nodes of both trees before a restart", positive=True)
    shorten: int = option(200, "attempts to shorten the plan on the common clock; 0: keep it as found", least=0)
    dt: float = option(GRID_STEP_S, "step of the time grid of the shortcuts [s]", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Plans a problem. Arguments and result are those of `Planner.plan`."""
        run = Run.begin("rrt-connect", self, problem, seed, time_limit)
        check_steps(problem, self.dt)
        try:
            for sub_seed in sub_seeds(run.seed):
                watch(SearchStarted(elapsed_s=run.elapsed_s, restart=run.counts.restarts, sub_seed=sub_seed))
                search = self._search(problem, sub_seed)
                found = False
                while not (found or run.clock.expired) and search.nodes < self.nodes:
                    path = search.grow(SLICE, run.clock)
                    found = path is not None and run.offer(retime_all_joints(problem, path))
                if found or run.clock.expired:
                    break
                run.counts.restarts += 1
            emit_and_shorten(run, watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result()

    def _search(self, problem: Problem, seed: int) -> core.CompositeSearch:
        return core.CompositeSearch(
            problem.cell.collision.core,
            start=problem.joint_start,
            goals=goal_combinations(problem, seed),
            **search_levels(problem),
            seed=seed,
            settings=core.CompositeSettings(range=self.range, step=self.step),
        )
