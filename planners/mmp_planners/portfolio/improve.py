"""Improves the plan of a run: single passes of shortcuts and LNS, and the rounds of `auto`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mmp_env.events import Watcher
from mmp_env.model.plan import Plan
from mmp_planners.counts import PortfolioCounts
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.path_recombination import PathRecombination
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.settings import PortfolioSettings
from mmp_planners.portfolio.shortcutting import Shortcutting
from mmp_planners.portfolio.wait_removal import without_waits
from mmp_planners.seeds import seed_of


@dataclass(frozen=True, kw_only=True)
class Step:
    """A part that shortens plans, and its seed. It is used only for plans whose cost is above `above` [rad]."""

    part: Shortcutting | LargeNeighbourhoodSearch
    seed: int
    above: float = 0.0


def improve(run: Run, *steps: Step, start: Plan | None = None) -> list[int]:
    """Shortens the best plan, or `start`, step by step, and offers the result to the run.

    Returns:
        The number of successes of each step. It is 0 for steps whose plan was not cheaper than the best plan or could
        not be certified.
    """
    plan = start if start is not None or run.best is None else run.best.plan
    if plan is None:
        return [0] * len(steps)
    plans, successes = [plan], []
    with run.early_clock() as clock:
        for step in steps:
            wanted = step.part.attempts > 0 and plans[-1].cost_rad > step.above and not clock.expired
            plan, count = step.part(plans[-1], step.seed, clock) if wanted else (plans[-1], 0)
            plans.append(plan)
            successes.append(count)
    while plans[-1] is not (run.best.plan if run.best else None) and not run.offer(plans[-1]):
        plans.pop()
        if not plans:
            break
    kept = max(len(plans) - 1, 0)
    successes = successes[:kept] + [0] * (len(steps) - kept)
    run.counts.shortcuts += sum(
        count for step, count in zip(steps, successes, strict=True) if isinstance(step.part, Shortcutting)
    )
    return successes


def shorten(run: Run, attempts: int, dt: float) -> bool:
    """Shortens the best plan on a grid of `dt` [s]. Returns whether it became shorter."""
    return improve(run, Step(part=Shortcutting(attempts=attempts, dt=dt), seed=seed_of(run.seed, 0)))[0] > 0


def emit_and_shorten(run: Run, watch: Watcher, attempts: int, dt: float) -> None:
    """Emits the best plan of a planner without a tree, and emits it again when it is shorter, or without waits."""
    run.emit_plan(watch, node=0, parent=None, dt=dt)
    node = 0
    if shorten(run, attempts, dt):
        run.emit_plan(watch, node=1, parent=0, dt=dt)
        node = 1
    if run.removes_waits and run.remove_waits():
        run.emit_plan(watch, node=node + 1, parent=node, dt=dt)


def best_without_waits(run: Run) -> Plan | None:
    """Returns the best plan without waits, not certified yet; None if waits are kept, or time is up."""
    if run.best is None or not run.removes_waits:
        return None
    with run.early_clock() as clock:
        return None if clock.expired else without_waits(run.best.plan, clock)


@dataclass(frozen=True, kw_only=True)
class ImprovementRounds:
    """The rounds in which `auto` improves its first plan.

    If the run removes waits, the first round begins with that: a plan with a shorter makespan has fewer steps, so its
    shortcuts take less time. Each later round begins with path recombination. Shortcuts and LNS then shorten its plan,
    or the best one. If the first plan is long, LNS comes before the shortcuts, with half as many attempts; both use a
    coarser grid then.

    Attributes:
        rounds: largest number of rounds.
        shorten: number of shortcut attempts per round.
        replan: number of LNS attempts per round.
        until: cost relative to the straight lines at which a plan is good enough.
        dt: step of the time grid [s].
        settings: thresholds and limits.
    """

    rounds: int
    shorten: int
    replan: int
    until: float
    dt: float
    settings: PortfolioSettings

    def __call__(self, run: Run, counts: PortfolioCounts, watch: Watcher, node: int) -> int:
        """Improves the best plan of the run, and emits each better one.

        Args:
            run: the run.
            counts: counts of the run.
            watch: watcher that gets the plans.
            node: number of the node of the best plan; better ones have the numbers after it.

        Returns:
            The number of the node of the last plan.
        """
        if run.best is None:
            return node
        settings, dt = self.settings, self.settings.grid_coarsening * self.dt
        good_cost = self.until * run.problem.cost_lower_bound_rad
        shortcuts = Shortcutting(attempts=self.shorten, dt=dt, repeat_gain=settings.repeat_gain)
        lns = LargeNeighbourhoodSearch(attempts=self.replan, dt=dt)
        recombine: PathRecombination | None = None
        failures = 0
        for number in range(self.rounds):
            before = run.best.cost
            if before <= good_cost or failures == settings.failures_before_stop or run.out_of_time:
                break
            if number == 0:
                start = best_without_waits(run)
            else:
                recombine = recombine or self._recombination(run, run.best.plan, shortcuts)
                orders = min(2 ** max(failures - 1, 0), settings.most_orders)
                start = recombine(run.best.plan, orders, number)
            if start is not None or failures < settings.failures_before_pause:
                steps = self._steps(run, number, shortcuts, lns, good_cost)
                successes = improve(run, *steps, start=start)
                counts.replanned += sum(  # `improve` counts the shortcuts
                    count
                    for step, count in zip(steps, successes, strict=True)
                    if isinstance(step.part, LargeNeighbourhoodSearch)
                )
                counts.recombined += number > 0 and start is not None and run.best.cost < before
            failures = failures + 1 if run.best.cost > (1 - settings.round_gain) * before else 0
            if run.best.cost < before:
                run.emit_plan(watch, node=node + 1, parent=node, dt=self.dt)
                node += 1
        return node

    def _steps(
        self, run: Run, number: int, shortcuts: Shortcutting, lns: LargeNeighbourhoodSearch, good_cost: float
    ) -> tuple[Step, ...]:
        """Returns the steps of a round: shortcuts, then LNS; for a long first plan LNS, then shortcuts."""
        shorten = Step(part=shortcuts, seed=seed_of(run.seed, number))
        replan = Step(part=lns, seed=seed_of(run.seed, number, 1), above=good_cost)
        long_cost = self.settings.long_plan * run.problem.cost_lower_bound_rad
        if number > 0 or run.best is None or run.best.cost <= long_cost:
            return shorten, replan
        coarse = self.settings.long_plan_coarsening * self.dt
        first = Step(part=replace(lns, attempts=math.ceil(lns.attempts / 2), dt=coarse), seed=seed_of(run.seed, 0, 2))
        return first, replace(shorten, part=replace(shortcuts, dt=coarse))

    def _recombination(self, run: Run, best: Plan, shortcuts: Shortcutting) -> PathRecombination:
        settings = self.settings
        independent = Shortcutting(
            attempts=settings.independent_attempts,
            dt=settings.grid_coarsening * self.dt,
            repeat_gain=settings.independent_repeat_gain,
        )
        return PathRecombination(run, best, self.dt, shortcuts, independent)
