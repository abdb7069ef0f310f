"""Orders of the arms for prioritized planning, and what is tried when an order fails.

Prioritized planning: Erdmann, Lozano-Perez: On multiple moving objects, Algorithmica 2, 1987. Random restarts of the
order: Bennewitz, Burgard, Thrun: Optimizing schedules for prioritized path planning of multi-robot systems, ICRA 2001.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mmp_env import core
from mmp_env.model.plan import Plan
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.counts import SingleArmCounts
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import Path, PlanningContext
from mmp_planners.seeds import quick_seed_of

LOW_LEVEL = SiRrtStar(iterations=60, shortcuts=20)
"""Single-arm planner with small limits: another order of the arms is worth more than a longer search in this one."""
PARKED_S = 2.0
"""Longest time that an arm still to be planned counts as parked at its start [s]."""
INDEPENDENT_TRIES = 3
"""Number of attempts to plan all arms independently before the search is exhausted."""
INDEPENDENT_BUDGET = 4.0
"""Iteration budget of a path that is planned independently, relative to that of the first order."""
GROUP_BUDGET = 3.0
"""Iteration budget in an order of a group. It is larger because a group has few orders."""
RESTART_GROWTH = 1.1
"""Growth of the iteration budget from one order to the next."""
LARGEST_BUDGET = 16.0
"""Largest iteration budget of an order."""
FAILED_FIRST_PROBABILITY = 0.8
"""Probability that the arm without a path comes first in the next order; otherwise all arms are shuffled."""
DETOUR_PROBABILITY = 0.25
"""Probability that an arm must avoid a random configuration on its own path, for a while or for good."""
FIRST_DETOUR_RESTART = 4
"""First restart with detours: no order helps where the own paths of two arms block each other."""
DETOUR_RADII_RAD = (0.2, 0.5)
"""Least and largest radius of the ball about that configuration [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Order:
    """An attempt: the order of the arms, how long each later arm is parked [steps], detours, budget and seed key."""

    arms: Sequence[int]
    parked: Sequence[int]
    detours: Sequence[Sequence[core.Constraint]]
    budget: float
    key: tuple[int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class PrioritySearch:
    """Plans the arms in random orders, each arm clear of the arms before it.

    Attributes:
        context: the problem on its time grid.
        counts: counts of the run.
        emitter: emits the events of the search.
        wait: longest time that an arm still to be planned counts as parked at its start [steps].
        experience: whether each single-arm search begins with the arm's own path.
    """

    context: PlanningContext
    counts: SingleArmCounts
    emitter: EventEmitter
    wait: int
    experience: bool = False

    def plan_independently(self, seed: int) -> list[Path] | None:
        """Returns a path of each arm as if it were the only one, or None when an arm finds no path, or time is up."""
        for attempt in range(INDEPENDENT_TRIES):
            self.context.reseed(quick_seed_of(seed, attempt))
            paths: list[Path] = []
            for arm in range(len(self.context.names)):
                path = self._plan(arm, (), (), INDEPENDENT_BUDGET, quick_seed_of(seed, attempt, arm))
                if path is None:
                    break
                paths.append(path)
            else:
                return paths
        return None

    def plans(self, seed: int, own: Sequence[Path]) -> Iterator[Plan | None]:
        """Yields for each order of the arms its plan, not certified yet, or None, until time is up.

        Args:
            seed: seed of the orders.
            own: an independent path of each arm.
        """
        rng = np.random.default_rng(seed)
        arms, parked, budget, detours = self._first_order(own), [0] * len(own), 1.0, _no_detours(own)
        for restart in itertools.count():
            if self.context.clock.expired:
                return
            self.emitter.search_started(restart, seed)
            key = (seed, INDEPENDENT_TRIES + restart)
            order = _Order(arms=arms, parked=parked, detours=detours, budget=budget, key=key)
            paths, failed = self._plan_in_order(order, own)
            yield self.context.plan([paths[arm] for arm in sorted(paths)]) if failed is None else None
            self.counts.restarts += 1
            budget = min(budget * RESTART_GROWTH, LARGEST_BUDGET)
            arms = _next_order(arms, failed, rng)
            parked = [int(k) for k in rng.integers(0, self.wait + 1, len(arms))]
            if restart + 1 >= FIRST_DETOUR_RESTART:
                detours = [_detour(path, rng) if rng.random() < DETOUR_PROBABILITY else [] for path in own]

    def plan_group(self, group: Sequence[int], tries: int, seed: int, own: Sequence[Path]) -> dict[int, Path] | None:
        """Returns paths of some arms as if there were no others, or None when `tries` orders fail."""
        rng = np.random.default_rng(seed)
        arms, parked = [int(arm) for arm in rng.permutation(group)], [0] * len(own)
        for attempt in range(tries):
            key = (seed, attempt)
            order = _Order(arms=arms, parked=parked, detours=_no_detours(own), budget=GROUP_BUDGET, key=key)
            paths, failed = self._plan_in_order(order, own)
            if failed is None:
                return paths
            if self.context.clock.expired:
                return None
            arms = _next_order(arms, failed, rng)
            parked = [int(k) for k in rng.integers(0, self.wait + 1, len(parked))]
        return None

    def _first_order(self, own: Sequence[Path]) -> list[int]:
        """Returns the arms by number of conflicts, most first, so that these keep their own paths."""
        conflicts = self.context.conflicts(own, self.context.pairs())
        self.counts.root_conflicts = sum(len(instants) for instants in conflicts.values())
        mine = [sum(len(c) for pair, c in conflicts.items() if arm in pair) for arm in range(len(own))]
        return sorted(range(len(own)), key=lambda arm: (-mine[arm], arm))

    def _plan_in_order(self, order: _Order, own: Sequence[Path]) -> tuple[dict[int, Path], int | None]:
        """Returns a path for each arm, clear of those before it; or no paths and the arm that found none."""
        paths: dict[int, Path] = {}
        for place, arm in enumerate(order.arms):
            before = list(paths.values())
            later = order.arms[place + 1 :]
            constraints = [self._parked(other, order.parked[other]) for other in later if order.parked[other] > 0]
            constraints += order.detours[arm]
            path = own[arm] if not constraints and self._is_clear(own[arm], before) else None
            if path is None:
                experience = own[arm] if self.experience else None
                seed = quick_seed_of(*order.key, arm)
                path = self._plan(arm, constraints, before, order.budget, seed, experience)
            if path is None:
                return {}, arm
            paths[arm] = path
        return paths, None

    def _is_clear(self, path: Path, others: Sequence[Path]) -> bool:
        return not self.context.conflicts([path, *others], [(0, k) for k in range(1, len(others) + 1)])

    def _parked(self, arm: int, steps: int) -> core.Constraint:
        start = self.context.problem.start[self.context.names[arm]]
        return core.Constraint.standing(self.context.core, arm, start, start=0, end=steps)

    def _plan(
        self,
        arm: int,
        constraints: Sequence[core.Constraint],
        others: Sequence[Path],
        budget: float,
        seed: int,
        experience: Path | None = None,
    ) -> Path | None:
        if self.context.clock.expired:
            return None
        self.counts.low_level_calls += 1
        known = None if experience is None else experience.q
        path, iterations = self.context.low_level(arm, constraints, seed, budget, others=others, experience=known)
        self.emitter.replanned(arm, len(constraints), path is not None, iterations, 1)
        return path


def _no_detours(own: Sequence[Path]) -> list[list[core.Constraint]]:
    return [[] for _ in own]


def _detour(own: Path, rng: np.random.Generator) -> list[core.Constraint]:
    """Returns a ball about a configuration on the arm's own path, or nothing if its start or goal is in the ball."""
    radius = rng.uniform(*DETOUR_RADII_RAD)
    center = own.q[rng.integers(0, own.last + 1)]
    until = core.FOREVER if rng.random() < 0.5 else int(rng.integers(1, 2 * own.last + 2))
    if min(np.abs(own.q[[0, -1]] - center).max(axis=1)) <= radius:
        return []
    return [core.Constraint.ball(center, radius, 0, until)]


def _next_order(arms: Sequence[int], failed: int | None, rng: np.random.Generator) -> list[int]:
    if failed is None or rng.random() >= FAILED_FIRST_PROBABILITY:
        return [int(arm) for arm in rng.permutation(sorted(arms))]
    return [failed, *(arm for arm in arms if arm != failed)]
