"""One run of a planner: its deadline, its counts, its best plan, and the result that it returns when time is up."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from mmp_env import core
from mmp_env.events import NodeCreated, SolutionFound, Watcher, ignore
from mmp_env.model.certificate import Certificate, certify
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_planners.counts import Incumbent, RunCounts
from mmp_planners.options import check_run
from mmp_planners.planner import PlanResult, Status, StopPlanning
from mmp_planners.portfolio.shortcutting import on_grid
from mmp_planners.portfolio.wait_removal import without_waits
from mmp_planners.result_validation import NUMBERS

PROOF_SHARE = 0.1
"""Share of the remaining time that is reserved for certification before the first proof."""
LEAST_PROOF_SHARE_S = 0.02
"""Least time that this share reserves [s]."""
FIRST_PROOFS = 8
"""Number of longest proofs that fit into the reserved time after the first proof: shortcuts add corners, and then a
proof takes longer. With 4, `rrt-connect` returned 20 ms late after 10 s."""
PROOFS = 4
"""Number of longest proofs that fit into the reserved time after the second proof."""
WAIT_REMOVAL_PROOFS = 15
"""Number of longest proofs so far that wait removal may take."""
WAIT_REMOVAL_SHARE = 0.05
"""Largest share of the remaining time that is reserved for wait removal: a lower cost comes first."""
LEAST_PROOF_S = 0.005
"""Least time that is reserved for certification [s]."""
LEAST_SAVING = 1e-3
"""Relative saving of makespan below which a plan keeps its waits."""


@dataclass(kw_only=True)
class Run:
    """One run of a planner.

    Attributes:
        name: name of the planner.
        options: the planner, a dataclass whose fields are its options.
        problem: the problem to solve.
        seed: seed of the run.
        clock: deadline of the run.
        removes_waits: whether the run ends with wait removal; time is reserved for it.
        counts: counts of the run, for its statistics.
        best: the best solution so far.
        without_waits: the best solution so far and the same one without waits, if they were removed.
        cut_short: whether an early clock has expired; the statistics then say `deadline_hit`.
        proof_s: duration of the longest certification [s].
        proofs: number of certified plans.
        began: start of the run by `time.perf_counter()` [s].
        found_s: time from the start to the first solution [s].
    """

    name: str
    options: Any
    problem: Problem
    seed: int
    clock: core.Clock
    removes_waits: bool = False
    counts: RunCounts = field(default_factory=RunCounts)
    best: Incumbent | None = None
    without_waits: tuple[Incumbent, Incumbent] | None = None
    cut_short: bool = False
    proof_s: float = 0.0
    proofs: int = 0
    began: float = field(default_factory=time.perf_counter)
    found_s: float | None = None

    @classmethod
    def begin(
        cls,
        name: str,
        options: Any,
        problem: Problem,
        seed: int,
        time_limit: float,
        *,
        counts: RunCounts | None = None,
        removes_waits: bool = False,
    ) -> Run:
        """Returns a run whose clock has started. Raises `MmpError` for a wrong problem, seed or time limit [s]."""
        seed, time_limit = check_run(problem, seed, time_limit)
        clock = core.Clock(min(time_limit, 1e10))
        counts = RunCounts() if counts is None else counts
        return cls(
            name=name,
            options=options,
            problem=problem,
            seed=seed,
            clock=clock,
            removes_waits=removes_waits,
            counts=counts,
        )

    @property
    def elapsed_s(self) -> float:
        return time.perf_counter() - self.began

    @property
    def out_of_time(self) -> bool:
        """Whether time is up but for what is reserved."""
        return self.cut_short or self.clock.expired

    def prove(self, plan: Plan, clock: core.Clock) -> Certificate:
        """Certifies a plan, and remembers how long the longest proof took."""
        before = time.perf_counter()
        certificate = certify(plan, clock)
        if certificate.valid:
            self.proof_s = max(self.proof_s, time.perf_counter() - before)
            self.proofs += 1
        return certificate

    def offer(self, plan: Plan) -> bool:
        """Takes a plan that is the cheapest so far, if it can be certified. Returns whether it was taken."""
        if self.best is not None and plan.cost_rad >= self.best.cost:
            return False
        certificate = self.prove(plan, self.clock)
        if not certificate.valid:
            self.counts.failed_certificates += not self.clock.expired
            return False
        bound_met = self.best.bound_met if self.best else None
        self.best = Incumbent(plan=plan, cost=plan.cost_rad, clearance=certificate.clearance, bound_met=bound_met)
        if self.found_s is None:
            self.found_s = self.elapsed_s
        return True

    def take(self, best: Incumbent | None, found_s: float | None) -> None:
        """Takes the best solution of a search that certifies its plans itself, found first after `found_s` [s]."""
        if best is not None and found_s is not None:
            self.best, self.found_s = best, found_s

    @property
    def final(self) -> Incumbent | None:
        """The best solution, without waits if they were removed."""
        if self.without_waits is not None and self.without_waits[0] is self.best:
            return self.without_waits[1]
        return self.best

    def remove_waits(self) -> bool:
        """Removes the waits of the best plan, if time is left. Returns whether its makespan became shorter."""
        if self.best is None or self.clock.expired:
            return False
        plan = without_waits(self.best.plan, self.clock)
        if plan is None or plan.makespan_s > (1 - LEAST_SAVING) * self.best.plan.makespan_s:
            return False
        certificate = self.prove(plan, self.clock)
        if not certificate.valid:
            self.counts.failed_certificates += not self.clock.expired
            return False
        early = dataclasses.replace(self.best, plan=plan, cost=plan.cost_rad, clearance=certificate.clearance)
        self.without_waits = self.best, early
        return True

    @contextlib.contextmanager
    def early_clock(self) -> Iterator[core.Clock]:
        """Gives a clock that expires early enough to certify what was found until then, without waits if asked."""
        remaining = min(self.clock.remaining, 1e10)
        reserved = max(PROOF_SHARE * remaining, LEAST_PROOF_SHARE_S)
        if self.proof_s > 0:
            proofs = FIRST_PROOFS if self.proofs == 1 else PROOFS
            reserved = min(reserved, max(proofs * self.proof_s, LEAST_PROOF_S))
        if self.removes_waits:
            reserved += min(WAIT_REMOVAL_PROOFS * self.proof_s, WAIT_REMOVAL_SHARE * remaining)
        clock = core.Clock(max(0.0, remaining - reserved))
        yield clock
        self.cut_short |= clock.expired

    def emit_plan(self, watch: Watcher, node: int, parent: int | None, dt: float) -> None:
        """Emits the best plan as a node, on a grid of `dt` [s], and as a solution. For planners without a tree."""
        best = self.final
        if best is None or watch is ignore:
            return
        names = self.problem.cell.arm_names
        watch(
            NodeCreated(
                elapsed_s=self.elapsed_s,
                node=node,
                parent=parent,
                arm=None,
                constraint=None,
                paths=dict(zip(names, on_grid(best.plan, dt), strict=True)),
                cost_rad=best.cost,
                lower_bound_rad=self.problem.cost_lower_bound_rad,
                conflicts=0,
                conflicting_pairs=0,
                dt_s=dt,
            )
        )
        watch(SolutionFound(elapsed_s=self.elapsed_s, node=node, cost_rad=best.cost, clearance_m=best.clearance))

    def result(self, *, exhausted: bool = False) -> PlanResult:
        """Returns the result of the run. `exhausted`: the search ended without a plan before its time."""
        while True:
            try:
                return self._result(exhausted)
            except StopPlanning:  # a signal handler may raise it even here
                continue

    def _result(self, exhausted: bool) -> PlanResult:
        best, straight = self.final, self.problem.cost_lower_bound_rad
        stats: dict[str, Any] = {
            **dict.fromkeys(NUMBERS),  # None: the planner has no such count
            **self.counts.stats(),
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
            planner = {"name": self.name, "options": dict(vars(self.options)), "seed": self.seed}
            plan = dataclasses.replace(best.plan, planner=planner, stats=dict(stats))
        status = Status.SOLVED if plan else Status.EXHAUSTED if exhausted else Status.TIMEOUT
        stats["first_plan_s"] = self.found_s
        stats["planning_time_s"] = time.perf_counter() - self.began
        return PlanResult(status=status, plan=plan, stats=stats)
