"""Ways of several plans put together anew, one for each arm: plans in which the arms pass each other in another order.

Shortcuts and replanning end where no single arm finds a shorter way among the others. What more there is to gain lies
in who passes whom, and on which side. So ways are collected: those of the best plan so far, each of them as short as it
becomes if its arm is the only one, those that few arms find among each other, and those that other orders of the arms
bring. Of the choices of one way for each arm the shortest that all arms can drive at once is taken
(`native/improve/path_recombination.hpp`). Waiting costs nothing, so all that has to be found is who waits for whom.

Most arms can keep the shortest way that they have alone: few pairs shut each other in. These are planned as if there
were no others, and together with those that they then are in the way of: independence detection (Standley, AAAI 2010).
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

from mmp_env import core
from mmp_env.events import ignore
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_planners.counts import SingleArmCounts
from mmp_planners.planning_context import Path
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.shortcutting import Shortcutting, on_grid, retime_to_velocity_limits
from mmp_planners.prioritized import Prioritized
from mmp_planners.seeds import quick_seed_of, seed_of

GAIN_RAD = 1e-3
"""Least that other ways must save."""
MOST_STEPS = 500
"""Of the first plan on the grid of the ways: what two arms may do is worked out by the product of their steps."""
MERGES = 2
"""Times that groups of arms are planned and looked at again."""
TRIES = 6
"""Orders of a group's arms, at most."""


class PathRecombination:
    """The ways of one run, on a grid of `dt` [s]; `shorten` is for plans, `alone` for ways without regard to others."""

    def __init__(self, run: Run, first: Plan, dt: float, shorten: Shortcutting, alone: Shortcutting) -> None:
        self._run, self._shorten, self._alone = run, shorten, alone
        self._grid = max(dt, first.makespan_s / MOST_STEPS)
        names = run.problem.cell.arm_names
        self._ways = core.PathRecombination(
            run.problem.cell.collision.core,
            [run.problem.max_velocity[name] * self._grid for name in names],
            run.problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
        )
        self._each = range(len(names))
        self._paths: dict[int, Path] = {}
        self._search = Prioritized(dt=self._grid).search(run, SingleArmCounts(), ignore)
        self._search.context.reseed(quick_seed_of(run.seed, 0))
        self._seen: Plan | None = None
        self._calls = 0

    def __call__(self, best: Plan, orders: int, turn: int) -> Plan | None:
        """A plan that is shorter than `best`, its certificate still to come, or None; none is given twice.

        In turn groups of arms are planned by themselves, and so many `orders` of all arms are tried; every `turn` has
        its own seeds.
        """
        clock = self._run.early_clock()
        self._search.context.clock = clock
        seeds = (seed_of(self._run.seed, turn, 2 + k) for k in itertools.count())
        if best is not self._seen:
            self._seen = best
            self._add(best)
            self._add_alone(best, next(seeds), clock)
        if not self._ways.has(self._ways.shortest()):
            return None  # too long for any of them
        self._calls += 1
        if self._calls % 2:
            self._groups(seeds, clock)
        else:
            self._another(orders, seeds, clock)
        rows = self._ways.recombine(best.cost_rad - GAIN_RAD, clock)
        self._run.cut_short |= clock.expired
        return None if rows is None else retime_to_velocity_limits(best.problem, rows)

    def _groups(self, seeds: Iterator[int], clock: core.Clock) -> None:
        """Arms that shut each other in find ways among themselves, for as long as more of them do."""
        choice, group = self._ways.shortest(), list(self._each)
        for _ in range(MERGES):
            if not self._ways.has(choice):
                return
            closed = self._ways.infeasible_pairs(choice, clock)
            if clock.expired:
                return
            for a, b in closed:
                group = [group[a] if g == group[b] else g for g in group]
            for label in sorted({group[a] for a, _ in closed}):
                arms = [arm for arm in self._each if group[arm] == label]
                found = self._together(arms, choice, seeds, clock)
                if found is not None:
                    for arm in arms:
                        choice[arm] = found[arm]

    def _together(
        self, arms: Sequence[int], choice: Sequence[int], seeds: Iterator[int], clock: core.Clock
    ) -> list[int] | None:
        """Numbers of ways: of `arms` that are clear of each other, and of the others."""
        self._begin_with(choice)
        paths = self._search.some(arms, TRIES, next(seeds))
        if paths is None or clock.expired:
            return None
        plan = self._search.context.plan([paths.get(arm, self._path(arm, choice[arm])) for arm in self._each])
        groups = [0 if arm in arms else 1 + arm for arm in self._each]
        found = self._add(self._shorten(plan, next(seeds), clock, groups=groups)[0])
        return None if any(found[arm] < 0 for arm in arms) else found

    def _another(self, orders: int, seeds: Iterator[int], clock: core.Clock) -> None:
        """The ways of a plan that another order of the arms brings, which begin with new ways of each arm alone."""
        run = dataclasses.replace(self._run, clock=clock, counts=SingleArmCounts(), best=None, found_s=None)
        search = self._search
        search.run, search.given = run, False
        if search.each_alone(next(seeds)):
            self._add_alone(search.context.plan(search.alone), next(seeds), clock)
        self._begin_with(self._ways.shortest())
        for _ in itertools.islice(search.rounds(next(seeds)), orders):
            pass
        self._run.proof_s = max(self._run.proof_s, run.proof_s)
        if run.best is not None:
            plan, _ = self._shorten(run.best.plan, next(seeds), clock)
            self._add(plan)

    def _begin_with(self, choice: Sequence[int]) -> None:
        self._search.alone = [self._path(arm, choice[arm]) for arm in self._each]
        self._search.given = True

    def _path(self, arm: int, number: int) -> Path:
        if number not in self._paths:
            self._paths[number] = self._search.context.path(arm, self._ways.path(arm, number))
        return self._paths[number]

    def _add_alone(self, plan: Plan, seed: int, clock: core.Clock) -> None:
        self._add(self._alone(plan, seed, clock, groups=self._each)[0])

    def _add(self, plan: Plan) -> list[int]:
        return self._ways.add(on_grid(plan, self._grid))
