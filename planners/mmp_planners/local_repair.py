"""Planner `local-repair`: prioritized planning that mends what fails where it fails, for cells of many arms.

Guarantee: neither complete nor bounded in cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from mmp_env.argument_checks import known_keywords
from mmp_env.events import Watcher, ignore
from mmp_env.model.problem import Problem
from mmp_planners.counts import SingleArmCounts
from mmp_planners.options import GRID_STEP_S, check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.portfolio.improve import emit_and_shorten
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.turns import Turn
from mmp_planners.prioritized import Prioritized
from mmp_planners.priority_search import LOW_LEVEL, PARKED_S
from mmp_planners.repair_search import RepairSearch


@dataclass(frozen=True, kw_only=True)
class LocalRepair:
    """Plans one arm after the other, and mends what fails where it fails.

    An arm without a path takes one that passes through some of the arms that block it, and these are planned again.
    Arms that block each other again are planned together in their composite space.
    """

    about: ClassVar[About] = About(
        paper="van den Berg, Snoeyink, Lin, Manocha: Centralized path planning for multiple robots: Optimal decoupling "
        "into sequential plans, RSS 2009 (coupled arms; with rip-up and reroute: Dees, Karger, DAC 1982)",
        url="https://doi.org/10.15607/RSS.2009.V.018",
        guarantee="neither complete (coupled groups are small) nor bounded in cost",
    )

    dt: float = option(GRID_STEP_S, "length of a step of the time grid [s]", positive=True)
    wait: float = option(PARKED_S, "longest time that an arm avoids the start of another one [s]", least=0.0)
    patience: int = option(
        1, "number of times that two arms block each other before they are planned together", least=0
    )
    coupled: int = option(6, "largest number of arms that are planned together", least=1)
    eta: float = option(LOW_LEVEL.eta, "steering distance of the single-arm planner [rad]", least=0.01)
    iterations: int = option(LOW_LEVEL.iterations, "single-arm iterations before an arm is blocked", positive=True)
    shortcuts: int = option(LOW_LEVEL.shortcuts, "attempts to shorten each single-arm path", positive=True)
    shorten: int = option(0, "attempts to shorten the plan on the common clock; 0: keep it as found", least=0)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Plans a problem. Arguments and result are those of `Planner.plan`."""
        counts = SingleArmCounts()
        run = Run.begin("local-repair", self, problem, seed, time_limit, counts=counts)
        check_steps(problem, self.dt)
        exhausted = False
        try:
            for _ in self.turns(run, counts, watch):
                pass
            exhausted = run.best is None and not run.clock.expired
            emit_and_shorten(run, watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result(exhausted=exhausted)

    def turns(self, run: Run, counts: SingleArmCounts, watch: Watcher) -> Iterator[Turn]:
        """Yields after each arm; ends with a plan, without time, or if an arm has no own path."""
        alone = Prioritized(
            dt=self.dt, wait=self.wait, eta=self.eta, iterations=self.iterations, shortcuts=self.shortcuts
        ).search(run, counts, watch)
        own = alone.plan_independently(run.seed)
        if own is None:
            return
        search = RepairSearch(
            context=alone.context,
            counts=counts,
            emitter=alone.emitter,
            wait=alone.wait,
            patience=self.patience,
            most_coupled=self.coupled,
        )
        done, failed = 0.0, 0
        for plan in search.plans(run.seed, own):
            if plan is not None and run.offer(plan):
                return
            yield Turn(alone.context.work - done, failed=search.failed_attempts > failed)
            done, failed = alone.context.work, search.failed_attempts
