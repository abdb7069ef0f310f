"""A planner that keeps the whole contract, and planners that each break one rule alone."""

import contextlib
import itertools
import math
import time
from dataclasses import dataclass, replace
from types import SimpleNamespace

from support.stand_in_planners import straight_plan

from mmp_env.errors import MmpError
from mmp_env.events import NodeExpanded, SolutionFound
from mmp_planners import PlanResult, Status, StopPlanning, ignore

_TIMES_CALLED = itertools.count()


@dataclass
class Sound:
    """Goes straight, and emits events before and after."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        self.refuse(seed)
        plan = None
        try:
            watch(NodeExpanded(elapsed_s=0.0, node=0, open_nodes=0, expanded_nodes=1, conflicts=0))
            if time_limit > 0:
                plan = self.found(problem, seed, watch)
                watch(SolutionFound(elapsed_s=0.0, node=0, cost_rad=plan.cost_rad, clearance_m=0.001))
        except StopPlanning:
            self.stopped(watch)
        stats = self.stats(problem, plan)
        return PlanResult(status=Status.SOLVED if plan else Status.TIMEOUT, plan=plan, stats=stats)

    def refuse(self, seed):
        if seed < 0:
            raise MmpError(f"seed is {seed}")

    def found(self, problem, seed, watch):
        return straight_plan(problem, {"name": "sound", "options": {}, "seed": seed})

    def stopped(self, watch):
        pass

    def stats(self, problem, plan):
        out = {"expanded_nodes": 1, "deadline_hit": plan is None, "cost_lower_bound_rad": problem.cost_lower_bound_rad}
        if plan:
            out |= {"cost_rad": plan.cost_rad, "makespan_s": plan.makespan_s, "min_clearance_m": 0.0001}
        return out


class OtherArguments(Sound):
    def plan(self, problem, seed, time_limit):
        return super().plan(problem)


class GivesUp(Sound):
    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        return PlanResult(status=Status.EXHAUSTED)


class CannotWaitForEver(Sound):
    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        int(time_limit)
        return super().plan(problem, seed=seed, time_limit=time_limit, watch=watch)


class TooFast(Sound):
    def found(self, problem, seed, watch):
        plan = super().found(problem, seed, watch)
        return replace(plan, times=plan.times / 2)


class ElsewhereAtTheEnd(Sound):
    def found(self, problem, seed, watch):
        plan = super().found(problem, seed, watch)
        return replace(plan, positions={arm: rows[::-1] for arm, rows in plan.positions.items()})


class ReturnsWords(Sound):
    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        return SimpleNamespace(status="solved", plan="that path", stats={})


class Moody(Sound):
    def found(self, problem, seed, watch):
        return straight_plan(problem, {"name": "moody"}, steps=3 + next(_TIMES_CALLED))


class WritesDownTheTime(Sound):
    def found(self, problem, seed, watch):
        return replace(super().found(problem, seed, watch), stats={"planning_time_s": time.perf_counter()})


class LikesToBeWatched(Sound):
    def found(self, problem, seed, watch):
        return straight_plan(problem, {"name": "vain"}, steps=4 if watch is ignore else 5)


class TellsInWords(Sound):
    def found(self, problem, seed, watch):
        if watch is not ignore:
            watch("halfway")
        return super().found(problem, seed, watch)


class LetsThrough(Sound):
    def stopped(self, watch):
        raise StopPlanning


class HasTheLastWord(Sound):
    def stopped(self, watch):
        with contextlib.suppress(StopPlanning):
            watch(NodeExpanded(elapsed_s=0.0, node=1, open_nodes=0, expanded_nodes=1, conflicts=0))


class Forgets(Sound):
    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        try:
            watch(SolutionFound(elapsed_s=0.0, node=0, cost_rad=0.0, clearance_m=0.001))
        except StopPlanning:
            return PlanResult(status=Status.TIMEOUT)
        return super().plan(problem, seed=seed, time_limit=time_limit)


class Late(Sound):
    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        if time_limit < 1:
            time.sleep(time_limit + 0.11)
        return super().plan(problem, seed=seed, time_limit=time_limit, watch=watch)


class FailsWithoutTime(Sound):
    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        1 / time_limit
        return super().plan(problem, seed=seed, time_limit=time_limit, watch=watch)


class Cheap(Sound):
    def stats(self, problem, plan):
        return super().stats(problem, plan) | {"cost_rad": 0.1}


class CountsDown(Sound):
    def stats(self, problem, plan):
        return super().stats(problem, plan) | {"low_level_calls": -1}


class CountsHalves(Sound):
    def stats(self, problem, plan):
        return super().stats(problem, plan) | {"root_conflicts": 1.5}


class ProvesTooMuch(Sound):
    def stats(self, problem, plan):
        return super().stats(problem, plan) | {"min_clearance_m": 1.0}


class HasAPlanOfItsOwn(Sound):
    def stats(self, problem, plan):
        return super().stats(problem, plan) | {"planner": self}


class Meddles(Sound):
    def found(self, problem, seed, watch):
        plan = super().found(problem, seed, watch)
        object.__setattr__(problem, "start", {arm: q + 1e-9 for arm, q in problem.start.items()})
        return plan


class TakesAnySeed(Sound):
    def refuse(self, seed):
        pass


class FailsAtSeeds(Sound):
    def refuse(self, seed):
        if seed < 0:
            raise KeyError(seed)


class Unpicklable(Sound):
    def __init__(self):
        self.found = lambda problem, seed, watch: straight_plan(problem, {"name": "unpicklable"})


class ForgetsItselfInPickle(Sound):
    steps = 4

    def __getstate__(self):
        return {"steps": 5}

    def found(self, problem, seed, watch):
        return straight_plan(problem, {"name": "forgetful"}, steps=self.steps)
