"""Prioritized planning (Erdmann and Lozano-Perez 1987) over SI-RRT* (Sim, Kim, Nam 2024, arXiv 2404.01752)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from mmp_env import core
from mmp_env.argument_checks import known_keywords
from mmp_env.events import Watcher, ignore
from mmp_env.model.problem import Problem
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.counts import SingleArmCounts
from mmp_planners.low_level import SiRrtStar
from mmp_planners.options import check_options, check_steps, option
from mmp_planners.planner import About, PlanResult, StopPlanning
from mmp_planners.planning_context import PlanningContext
from mmp_planners.portfolio.run import Run
from mmp_planners.priority_search import PrioritySearch


@dataclass(frozen=True, kw_only=True)
class Prioritized:
    """Prioritized planning: one arm after the other among those that move already, with orders reshuffled.

    Each arm is planned in space and time by SI-RRT*, the paths of the arms before it being obstacles that move. Where
    one finds no way the next restart plans it first, mostly, and arms that are still to come count as parked at their
    start for a random while, so that those before them do not run them over.
    """

    about: ClassVar[About] = About(
        paper="Erdmann, Lozano-Pérez: On multiple moving objects, Algorithmica 2, 1987 (with the single-arm planner of "
        "Sim, Kim, Nam 2024, arXiv 2404.01752)",
        url="https://doi.org/10.1007/BF01840371",
        guarantee="neither complete (an instance may need all arms to give way at once) nor bounded in cost",
    )

    dt: float = option(0.1, "length of a step of the time grid [s]", positive=True)
    wait: float = option(2.0, "seconds that arms still to be planned may count as parked at their start", least=0.0)
    eta: float = option(core.STEERING_RAD, "steering distance of the single-arm planner [rad]", least=0.01)
    iterations: int = option(60, "single-arm iterations before an arm is given up; grows by restart", positive=True)
    shortcuts: int = option(20, "attempts to shorten each single-arm path", positive=True)
    shorten: int = option(0, "attempts to shorten the plan on the common clock; 0: as it was found", least=0)

    def __post_init__(self) -> None:
        check_options(self)

    @known_keywords
    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        run = Run.begin("prioritized", self, problem, seed, time_limit)
        run.counts = counts = SingleArmCounts()
        check_steps(problem, self.dt)
        try:
            search = self.search(run, counts, watch)
            for _ in search.rounds(run.seed):
                pass
            run.exhausted = search.exhausted
            run.emit_and_shorten(watch, self.shorten, self.dt)
        except StopPlanning:
            pass
        return run.result()

    def search(self, run: Run, counts: SingleArmCounts, watch: Watcher) -> PrioritySearch:
        """The search of a run, about to begin."""
        low_level = SiRrtStar(eta=self.eta, iterations=self.iterations, shortcuts=self.shortcuts)
        context = PlanningContext(run.problem, self.dt, low_level, run.clock)
        wait = math.ceil(self.wait / self.dt)
        return PrioritySearch(context=context, run=run, counts=counts, emitter=EventEmitter(watch, context), wait=wait)
