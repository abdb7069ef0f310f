"""Path recombination: chooses one known path per arm, and times the chosen paths together.

Shortcuts and LNS end when no single arm finds a shorter path among the others. The arms could still pass each other in
another order, or on another side. So a path pool collects the paths of the best plan, the same paths shortened without
the other arms, paths of small groups of arms, and paths of other orders. The native search takes the shortest choice of
one path per arm that can be timed, by coordination diagrams (O'Donnell, Lozano-Perez: Deadlock-free and collision-free
coordination of two robot manipulators, ICRA 1989; `native/improve/path_recombination.hpp`). Waiting costs
nothing, so the search decides only which arm waits for which.

Most arms can keep their shortest independent path, because few pairs block each other. These pairs are planned as
groups, in their composite space or one arm after the other, and groups that the new paths block are merged
(independence detection: Standley: Finding optimal solutions to
cooperative pathfinding problems, AAAI 2010).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from mmp_env import core
from mmp_env.events import ignore
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.counts import SingleArmCounts
from mmp_planners.planning_context import Path, PlanningContext
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.search_levels import search_levels
from mmp_planners.portfolio.shortcutting import Shortcutting, divided, on_grid, retime_to_velocity_limits
from mmp_planners.priority_search import LOW_LEVEL, PARKED_S, PrioritySearch
from mmp_planners.seeds import quick_seed_of, seed_of

GAIN_RAD = 1e-3
"""Minimum saving of a recombined plan [rad]."""
MOST_STEPS = 500
"""Largest number of grid steps of the first plan: a coordination diagram has the product of two arms' steps."""
MERGES = 2
"""Number of times that groups of arms are merged and planned."""
GROUP_TRIES = 6
"""Largest number of orders in which a group is planned."""
ITERATIONS = 1000
"""Largest number of iterations of the search in the composite space of a group."""


class PathRecombination:
    """The path pool of one run.

    Args:
        run: the run, for its problem, seed and clock.
        first: the plan to improve; a long one makes the grid coarser.
        dt: least step of the pool's grid [s].
        shorten: shortcuts for plans.
        independent: shortcuts for paths without regard to other arms.
    """

    def __init__(self, run: Run, first: Plan, dt: float, shorten: Shortcutting, independent: Shortcutting) -> None:
        self._run, self._shorten, self._independent = run, shorten, independent
        self._grid = max(dt, first.makespan_s / MOST_STEPS)
        problem, names = run.problem, run.problem.cell.arm_names
        self._pool = core.PathRecombination(
            problem.cell.collision.core,
            [problem.max_velocity[name] * self._grid for name in names],
            problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
        )
        self._arms = range(len(names))
        self._paths: dict[int, Path] = {}
        self._context = PlanningContext(problem, self._grid, LOW_LEVEL, run.clock)
        self._context.reseed(quick_seed_of(run.seed, 0))
        self._last_best: Plan | None = None
        self._calls = 0

    def __call__(self, best: Plan, orders: int, round_number: int) -> Plan | None:
        """Recombines the paths of the pool, after it has added new ones.

        Calls alternate between planning groups of arms and trying orders of all arms.

        Args:
            best: the best plan so far.
            orders: number of orders to try.
            round_number: number of the round; each round has its own seeds.

        Returns:
            A plan that costs less than `best`, not certified yet, or None. No choice of paths is returned twice.
        """
        seeds = (seed_of(self._run.seed, round_number, 2 + k) for k in itertools.count())
        with self._run.early_clock() as clock:
            self._context = self._context.with_clock(clock)
            if best is not self._last_best:
                self._last_best = best
                self._add(best)
                self._add_independent(best, next(seeds), clock)
            if not self._pool.has(self._pool.shortest()):
                return None  # the pool takes no path that is so long
            self._calls += 1
            if self._calls % 2:
                self._plan_groups(seeds, clock)
            else:
                self._try_orders(orders, seeds, clock)
            rows = self._pool.recombine(best.cost_rad - GAIN_RAD, clock)
        return None if rows is None else retime_to_velocity_limits(best.problem, rows)

    def _plan_groups(self, seeds: Iterator[int], clock: core.Clock) -> None:
        """Plans mutually blocking arms as groups, and merges groups that the new paths block."""
        choice, group = self._pool.shortest(), list(self._arms)
        for _ in range(MERGES):
            if not self._pool.has(choice):
                return
            blocked = self._pool.infeasible_pairs(choice, clock)
            if clock.expired:
                return
            for a, b in blocked:
                group = [group[a] if g == group[b] else g for g in group]
            for label in sorted({group[a] for a, _ in blocked}):
                members = [arm for arm in self._arms if group[arm] == label]
                found = self._plan_group(members, choice, seeds, clock)
                if found is not None:
                    for arm in members:
                        choice[arm] = found[arm]

    def _plan_group(
        self, members: Sequence[int], choice: Sequence[int], seeds: Iterator[int], clock: core.Clock
    ) -> list[int] | None:
        """Returns ids of paths on which the members are clear of each other, or None."""
        known = self._known(choice)
        # Alternately, because each of them finds paths that the other one does not.
        in_order = self._calls % 4 == 3
        paths = (self._plan_in_order if in_order else self._plan_together)(members, known, next(seeds), clock)
        if paths is None or clock.expired:
            return None
        plan = self._context.plan([paths.get(arm, known[arm]) for arm in self._arms])
        groups = [0 if arm in members else 1 + arm for arm in self._arms]
        ids = self._add(self._shorten(plan, next(seeds), clock, groups=groups)[0])
        return None if any(ids[arm] < 0 for arm in members) else ids

    def _plan_in_order(
        self, members: Sequence[int], known: Sequence[Path], seed: int, clock: core.Clock
    ) -> dict[int, Path] | None:
        return self._search(experience=True).plan_group(members, GROUP_TRIES, seed, known)

    def _plan_together(
        self, members: Sequence[int], known: Sequence[Path], seed: int, clock: core.Clock
    ) -> dict[int, Path] | None:
        """Returns paths of some arms from their composite space, as if there were no others, or None."""
        problem = self._run.problem
        search = core.CompositeSearch(
            problem.cell.collision.core,
            start=np.concatenate([known[arm].q[0] for arm in members]),
            goals=np.concatenate([known[arm].q[-1] for arm in members])[None],
            **search_levels(problem),
            seed=seed,
            arms=list(members),
        )
        path = search.grow(ITERATIONS, clock)
        if path is None:
            return None
        rows = np.split(path, np.cumsum([known[arm].q.shape[1] for arm in members])[:-1], axis=1)
        steps = [np.abs(np.diff(q, axis=0)) / self._context.max_step[arm] for arm, q in zip(members, rows, strict=True)]
        counts = np.ceil(np.concatenate(steps, axis=1).max(axis=1)).astype(int)
        return {arm: self._context.path(arm, q) for arm, q in zip(members, divided(rows, counts), strict=True)}

    def _try_orders(self, orders: int, seeds: Iterator[int], clock: core.Clock) -> None:
        """Adds new independent paths, and the paths of the first order of the arms that has a certified plan."""
        own = self._search(experience=False).plan_independently(next(seeds))
        if own is not None:
            self._add_independent(self._context.plan(own), next(seeds), clock)
        known = self._known(self._pool.shortest())
        for plan in itertools.islice(self._search(experience=True).plans(next(seeds), known), orders):
            if plan is not None and self._run.prove(plan, clock).valid:
                self._add(self._shorten(plan, next(seeds), clock)[0])
                return

    def _search(self, *, experience: bool) -> PrioritySearch:
        return PrioritySearch(
            context=self._context,
            counts=SingleArmCounts(),
            emitter=EventEmitter(ignore, self._context),
            wait=math.ceil(PARKED_S / self._grid),
            experience=experience,
        )

    def _known(self, choice: Sequence[int]) -> list[Path]:
        for arm, number in enumerate(choice):
            if number not in self._paths:
                self._paths[number] = self._context.path(arm, self._pool.path(arm, number))
        return [self._paths[number] for number in choice]

    def _add_independent(self, plan: Plan, seed: int, clock: core.Clock) -> None:
        self._add(self._independent(plan, seed, clock, groups=self._arms)[0])

    def _add(self, plan: Plan) -> list[int]:
        return self._pool.add(on_grid(plan, self._grid))
