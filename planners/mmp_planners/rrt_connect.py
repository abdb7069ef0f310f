"""RRT-Connect: Kuffner, LaValle: RRT-Connect: An efficient approach to single-query path planning, ICRA 2000; here in
the composite space of all arms.

Guarantee: probabilistically complete, up to the margin and the step between samples. No bound on the cost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mmp_env import core
from mmp_env.argument_checks import known_keywords
from mmp_env.events import SearchStarted, Watcher, ignore
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.goal_combinations import goal_combinations
from mmp_planners.options import GRID_STEP_S, check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.portfolio.improve import emit_and_shorten
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.shortcutting import retime_to_velocity_limits
from mmp_planners.seeds import sub_seeds

NODES = 200_000
"""Largest number of nodes of both trees before a restart."""
SLICE = 200
"""Number of iterations between two checks of the number of nodes."""


@dataclass(frozen=True, kw_only=True)
class Composite:
    """Two trees over all joints of all arms that grow towards each other (`native/joint_space/composite_rrt.hpp`).

    On an edge each arm moves by at most `range` [rad, L2], tested every `step` [rad]. Arms that would meet move one
    after the other, and a blocked arm does not hold up the others. A path that joins the trees is proved at every
    instant. Edges without a proof are removed, and the trees grow on. The tree of the goals has one root per
    combination of the arms' candidates (`goal_combinations`).
    """

    range: float = core.CompositeSettings().range
    step: float = core.CompositeSettings().step

    def search(self, problem: Problem, seed: int) -> core.CompositeSearch:
        """Returns a search that can go on after each call of `grow`."""
        names = problem.cell.arm_names
        return core.CompositeSearch(
            problem.cell.collision.core,
            start=np.concatenate([problem.start[name] for name in names]),
            goals=goal_combinations(problem, seed),
            samples=problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
            edges=problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            seed=seed,
            settings=core.CompositeSettings(range=self.range, step=self.step),
        )

    def grow(self, problem: Problem, search: core.CompositeSearch, iterations: int, clock: core.Clock) -> Plan | None:
        """Returns a plan, not certified yet, or None if that many more iterations find none."""
        path = search.grow(iterations, clock)
        if path is None:
            return None
        ends = np.cumsum([arm.dof for arm in problem.cell.arms])[:-1]
        return retime_to_velocity_limits(problem, np.split(path, ends, axis=1))


@dataclass(frozen=True, kw_only=True)
class RrtConnect:
    """RRT-Connect over all joints of all arms at once: a fast and long first plan, then shortcuts."""

    about: ClassVar[About] = About(
        paper="Kuffner, LaValle: RRT-Connect: An efficient approach to single-query path planning, ICRA 2000",
        url="https://doi.org/10.1109/ROBOT.2000.844730",
        guarantee="probabilistically complete, up to the margin and the step between samples; no bound on the cost",
    )

    range: float = option(Composite.range, "longest move of an arm on an edge of the trees, L2 [rad]", least=0.01)
    step: float = option(Composite.step, "distance between samples of an edge, largest joint [rad]", least=0.001)
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
        composite = Composite(range=self.range, step=self.step)
        try:
            for sub_seed in sub_seeds(run.seed):
                watch(SearchStarted(elapsed_s=run.elapsed_s, restart=run.counts.restarts, sub_seed=sub_seed))
                search = composite.search(problem, sub_seed)
                found = False
                while not (found or run.clock.expired) and search.nodes < self.nodes:
                    plan = composite.grow(problem, search, SLICE, run.clock)
                    found = plan is not None and run.offer(plan)
                if found or run.clock.expired:
                    break
                run.counts.restarts += 1
            emit_and_shorten(run, watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result()
