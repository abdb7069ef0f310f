"""Prioritized planning: Erdmann, Lozano-Perez: On multiple moving objects, Algorithmica 2, 1987; here over SI-RRT*
(Sim, Kim, Nam: Safe interval RRT* for scalable multi-robot path planning in continuous space, arXiv 2404.01752, 2024).

Guarantee: neither complete nor bounded in cost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from mmp_env.argument_checks import known_keywords
from mmp_env.events import Watcher, ignore
from mmp_env.model.problem import Problem
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.counts import SingleArmCounts
from mmp_planners.low_level import SiRrtStar
from mmp_planners.options import GRID_STEP_S, check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.planning_context import PlanningContext
from mmp_planners.portfolio.improve import emit_and_shorten
from mmp_planners.portfolio.run import Run
from mmp_planners.priority_search import LOW_LEVEL, PARKED_S, PrioritySearch


@dataclass(frozen=True, kw_only=True)
class Prioritized:
    """Prioritized planning: plans one arm after the other, each clear of the arms before it, in random orders.

    SI-RRT* plans each arm in space and time; the paths of the arms before it are dynamic obstacles. If an arm finds no
    path, the next order mostly begins with it. Arms still to be planned count as parked at their start for a random
    time, so that the arms before them leave them room.
    """

    about: ClassVar[About] = About(
        paper="Erdmann, Lozano-Pérez: On multiple moving objects, Algorithmica 2, 1987 (with the single-arm planner of "
        "Sim, Kim, Nam 2024, arXiv 2404.01752)",
        url="https://doi.org/10.1007/BF01840371",
        guarantee="neither complete (an instance may need all arms to give way at once) nor bounded in cost",
    )

    dt: float = option(GRID_STEP_S, "length of a step of the time grid [s]", positive=True)
    wait: float = option(
        PARKED_S, "longest time that arms still to be planned count as parked at their start [s]", least=0.0
    )
    eta: float = option(LOW_LEVEL.eta, "steering distance of the single-arm planner [rad]", least=0.01, most=100)
    iterations: int = option(
        LOW_LEVEL.iterations, "single-arm iterations before an arm fails; grows by restart", positive=True
    )
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
        run = Run.begin("prioritized", self, problem, seed, time_limit, counts=counts)
        check_steps(problem, self.dt)
        exhausted = False
        try:
            search = self.search(run, counts, watch)
            own = search.plan_independently(run.seed)
            exhausted = own is None and not run.clock.expired
            for plan in search.plans(run.seed, own) if own is not None else ():
                if plan is not None and run.offer(plan):
                    break
            emit_and_shorten(run, watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result(exhausted=exhausted)

    def search(self, run: Run, counts: SingleArmCounts, watch: Watcher) -> PrioritySearch:
        """Returns the search of a run, about to begin."""
        low_level = SiRrtStar(eta=self.eta, iterations=self.iterations, shortcuts=self.shortcuts)
        context = PlanningContext(run.problem, self.dt, low_level, run.clock)
        emitter = EventEmitter(watch, context)
        return PrioritySearch(context=context, counts=counts, emitter=emitter, wait=math.ceil(self.wait / self.dt))
