"""RRT-Connect in the composite space of all arms (Kuffner and LaValle, ICRA 2000): the baseline to beat."""

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
from mmp_planners.options import check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.shortcutting import retime_to_velocity_limits
from mmp_planners.seeds import sub_seeds

_DEFAULT = core.CompositeSettings()
NODES = 200_000
SLICE = 2000
"""Iterations between two looks at how large the trees have become."""


@dataclass(frozen=True, kw_only=True)
class Composite:
    """Two trees over all joints of all arms that grow towards each other; edges are looked at every `step` [rad] and
    are `range` [rad, L2] long at most. A way is proved at every instant before it is believed; the edges that cannot be
    proved fall, and the trees grow on (`native/joint_space/composite_rrt.hpp`).
    """

    range: float = _DEFAULT.range
    step: float = _DEFAULT.step

    def search(self, problem: Problem, seed: int) -> core.CompositeSearch:
        """A search that can be asked to go on."""
        names = problem.cell.arm_names
        return core.CompositeSearch(
            problem.cell.collision.core,
            start=np.concatenate([problem.start[name] for name in names]),
            goal=np.concatenate([problem.goal[name] for name in names]),
            samples=problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
            edges=problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            seed=seed,
            settings=core.CompositeSettings(range=self.range, step=self.step),
        )

    def grow(self, problem: Problem, search: core.CompositeSearch, iterations: int, clock: core.Clock) -> Plan | None:
        """The plan, if that many more iterations find one."""
        way = search.grow(iterations, clock)
        if way is None:
            return None
        ends = np.cumsum([arm.dof for arm in problem.cell.arms])[:-1]
        return retime_to_velocity_limits(problem, np.split(way, ends, axis=1))


@dataclass(frozen=True, kw_only=True)
class RrtConnect:
    """RRT-Connect over all joints of all arms at once: the fastest first plan, a long one, and then shortcuts."""

    about: ClassVar[About] = About(
        paper="Kuffner, LaValle: RRT-Connect: An efficient approach to single-query path planning, ICRA 2000",
        url="https://doi.org/10.1109/ROBOT.2000.844730",
        guarantee="probabilistically complete, up to the margin and the step between samples; no bound on the cost",
    )

    range: float = option(_DEFAULT.range, "longest edge of the trees, L2 over all joints of all arms [rad]", least=0.01)
    step: float = option(_DEFAULT.step, "distance between samples of an edge, largest joint [rad]", least=0.001)
    nodes: int = option(NODES, "nodes of both trees before they are planted anew", positive=True)
    shorten: int = option(200, "attempts to shorten the plan on the common clock; 0: as it was found", least=0)
    dt: float = option(0.1, "step of the time grid that it is shortened on [s]", positive=True)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
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
            run.emit_and_shorten(watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result()
