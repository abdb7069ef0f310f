"""How a run ends: what was found, shortened where that is asked for, as a result with its statistics."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass, field
from typing import Any

from mmp_env import core
from mmp_env.events import NodeCreated, SolutionFound, Watcher, ignore
from mmp_env.model.certificate import certify
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.counts import Incumbent, RunCounts
from mmp_planners.options import check_run
from mmp_planners.planner import PlanResult, Status, StopPlanning
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.shortcutting import Shortcutting, on_grid
from mmp_planners.result_validation import NUMBERS
from mmp_planners.seeds import seed_of

PROOF_SHARE, PROOF_S = 0.1, 0.02
"""What shortening leaves of the time that is left, so that what it found can be proved: a share, or so many seconds."""
PROOFS, LEAST_PROOF_S = 8, 0.005
"""As many times as long as the longest proof so far is enough, but no less than this [s]: corners become more."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """A part that makes plans shorter, with its seed; only for plans that are longer than `above` [rad]."""

    part: Shortcutting | LargeNeighbourhoodSearch
    seed: int
    above: float = 0.0


@dataclass(kw_only=True)
class Run:
    """One run of a planner: its clock, its counts and the best solution that it has so far."""

    name: str
    options: Any
    problem: Problem
    seed: int
    clock: core.Clock
    counts: RunCounts = field(default_factory=RunCounts)
    best: Incumbent | None = None
    exhausted: bool = False
    cut_short: bool = False
    """Whether time ended something before the clock did, which kept a rest for the proof."""
    proof_s: float = 0.0
    """How long the longest proof took."""
    began: float = field(default_factory=time.perf_counter)
    found_s: float | None = None

    @classmethod
    def begin(cls, name: str, options: Any, problem: Problem, seed: int, time_limit: float) -> Run:
        """The clock starts. Raises `MmpError` like `check_run`."""
        seed, time_limit = check_run(problem, seed, time_limit)
        clock = core.Clock(min(time_limit, 1e10))
        return cls(name=name, options=options, problem=problem, seed=seed, clock=clock)

    def offer(self, plan: Plan) -> bool:
        """Takes a plan that can be proved and is the cheapest so far."""
        if self.best is not None and plan.cost_rad >= self.best.cost:
            return False
        before = time.perf_counter()
        certificate = certify(plan, self.clock)
        if not certificate.valid:
            self.counts.failed_certificates += not self.clock.expired
            return False
        self.proof_s = max(self.proof_s, time.perf_counter() - before)
        bound_met = self.best.bound_met if self.best else None
        self.best = Incumbent(plan=plan, cost=plan.cost_rad, clearance=certificate.clearance, bound_met=bound_met)
        if self.found_s is None:
            self.found_s = self.elapsed_s
        return True

    def take(self, best: Incumbent | None, found_s: float | None) -> None:
        """The best of a search that proves its plans itself, the first of which it found after `found_s` [s]."""
        if best is not None and found_s is not None:
            self.best, self.found_s = best, found_s

    @property
    def elapsed_s(self) -> float:
        return time.perf_counter() - self.began

    def emit_plan(self, watch: Watcher, node: int, parent: int | None, dt: float) -> None:
        """The best plan as a node of its own and a solution, for planners that have no tree to show."""
        if self.best is None or watch is ignore:
            return
        names = self.problem.cell.arm_names
        watch(
            NodeCreated(
                elapsed_s=self.elapsed_s,
                node=node,
                parent=parent,
                arm=None,
                constraint=None,
                paths=dict(zip(names, on_grid(self.best.plan, dt), strict=True)),
                cost_rad=self.best.cost,
                lower_bound_rad=self.problem.cost_lower_bound_rad,
                conflicts=0,
                conflicting_pairs=0,
                dt_s=dt,
            )
        )
        watch(
            SolutionFound(elapsed_s=self.elapsed_s, node=node, cost_rad=self.best.cost, clearance_m=self.best.clearance)
        )

    def shorten(self, attempts: int, dt: float) -> bool:
        """The best plan made shorter; False where there is none or it stays as it is."""
        return self.improve(Step(part=Shortcutting(attempts=attempts, dt=dt), seed=seed_of(self.seed, 0)))[0] > 0

    def improve(self, *steps: Step, start: Plan | None = None) -> list[int]:
        """The best plan, or `start`, made shorter step by step, and proved: how often each step succeeded.

        Zeros where there is no plan, and from the step on whose plan is not shorter than the best or not proved.
        """
        plan = start if start is not None or self.best is None else self.best.plan
        if plan is None:
            return [0] * len(steps)
        clock, plans, succeeded = self.early_clock(), [plan], []
        for step in steps:
            wanted = step.part.attempts > 0 and plans[-1].cost_rad > step.above
            plan, kept = step.part(plans[-1], step.seed, clock) if wanted else (plans[-1], 0)
            plans.append(plan)
            succeeded.append(kept)
        self.cut_short |= clock.expired
        while plans[-1] is not (self.best.plan if self.best else None) and not self.offer(plans[-1]):
            plans.pop()
            if not plans:
                break
        kept_steps = max(len(plans) - 1, 0)
        succeeded = succeeded[:kept_steps] + [0] * (len(steps) - kept_steps)
        for step, kept in zip(steps, succeeded, strict=True):
            if isinstance(step.part, Shortcutting):
                self.counts.shortcuts += kept
        return succeeded

    def early_clock(self) -> core.Clock:
        """One that ends so early that what was found until then can be proved."""
        remaining = min(self.clock.remaining, 1e10)
        kept = max(PROOF_SHARE * remaining, PROOF_S)
        if self.proof_s > 0:
            kept = min(kept, max(PROOFS * self.proof_s, LEAST_PROOF_S))
        return core.Clock(max(0.0, remaining - kept))

    def emit_and_shorten(self, watch: Watcher, attempts: int, dt: float) -> None:
        """The end of a planner without a tree: its plan is told, and told again where `attempts` have shortened it."""
        self.emit_plan(watch, node=0, parent=None, dt=dt)
        if self.shorten(attempts, dt):
            self.emit_plan(watch, node=1, parent=0, dt=dt)

    def result(self) -> PlanResult:
        """What came of it. A signal handler may raise `StopPlanning` even here, so it is made again."""
        while True:
            try:
                return self._result()
            except StopPlanning:
                continue

    def _result(self) -> PlanResult:
        best, straight = self.best, self.problem.cost_lower_bound_rad
        stats: dict[str, Any] = {
            **dict.fromkeys(NUMBERS),  # None: the planner has no such thing
            **dataclasses.asdict(self.counts),
            "cost_rad": None,
            "makespan_s": None,
            "cost_lower_bound_rad": straight,
            "cost_ratio": None,
            "min_clearance_m": None,
            "bound_met": None,
            "deadline_hit": self.clock.expired or self.cut_short,
        }
        plan = None
        if best is not None:
            stats |= {
                "cost_rad": best.plan.cost_rad,
                "makespan_s": best.plan.makespan_s,
                "cost_ratio": best.plan.cost_rad / straight if straight > 0 else 1.0,
                "min_clearance_m": best.clearance,
                "bound_met": best.bound_met,
            }
            planner = {"name": self.name, "options": dataclasses.asdict(self.options), "seed": self.seed}
            plan = dataclasses.replace(best.plan, planner=planner, stats=dict(stats))
        status = Status.SOLVED if plan else Status.EXHAUSTED if self.exhausted else Status.TIMEOUT
        stats["first_plan_s"] = self.found_s
        stats["planning_time_s"] = time.perf_counter() - self.began
        return PlanResult(status=status, plan=plan, stats=stats)
