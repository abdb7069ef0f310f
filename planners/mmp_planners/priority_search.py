"""In which order arms are planned when each keeps clear of those before it, and what is tried when that fails."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from mmp_env import core
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.counts import SingleArmCounts
from mmp_planners.planning_context import Path, PlanningContext
from mmp_planners.portfolio.run import Run
from mmp_planners.seeds import quick_seed_of

ALONE_TRIES = 3
ALONE_BUDGET = 4.0
SOME_BUDGET = 3.0
"""Few arms are worth more than one of many orders of all of them."""
RESTART_GROWTH = 1.1
LARGEST_BUDGET = 16.0
FORWARD = 0.8
"""How often the arm that found no way goes first in the next order; otherwise all of them are shuffled."""
DETOUR = 0.25
"""How often an arm is kept from a random place on its own way, for a while or for good."""
DETOURS_FROM = 4
"""The restart from which there are detours: where the own ways of two arms shut in each other no order helps."""
DETOUR_RAD = (0.2, 0.5)


@dataclass(kw_only=True)
class PrioritySearch:
    """One run: orders of the arms until one of them works."""

    context: PlanningContext
    run: Run
    counts: SingleArmCounts
    emitter: EventEmitter
    wait: int
    """Steps that arms which are not planned yet may count as parked at their start, at most."""
    alone: list[Path] = field(default_factory=list)
    """A way of each arm as if it were the only one."""
    given: bool = False
    """Whether these ways are given. Then every search begins with its arm's own."""
    exhausted: bool = False
    """Whether an arm finds no way even alone."""

    def rounds(self, seed: int) -> Iterator[None]:
        """One order of the arms each, until there is a plan, time is up, or an arm finds no way even alone."""
        if not self.given and not self.each_alone(seed):
            self.exhausted = not self.context.clock.expired
            return
        rng = np.random.default_rng(seed)
        order, parked, budget, detours = self._first_order(), [0] * len(self.alone), 1.0, self._no_detours()
        for restart in itertools.count():
            if self.context.clock.expired:
                return
            self.emitter.search_started(restart, seed)
            paths, failed = self._one_after_the_other(order, parked, detours, budget, (seed, ALONE_TRIES + restart))
            if failed is None and self.run.offer(self.context.plan([paths[arm] for arm in sorted(paths)])):
                return
            yield
            self.counts.restarts += 1
            budget = min(budget * RESTART_GROWTH, LARGEST_BUDGET)
            order = _next_order(order, failed, rng)
            parked = [int(k) for k in rng.integers(0, self.wait + 1, len(order))]
            if restart + 1 >= DETOURS_FROM:
                detours = [self._detour(arm, rng) if rng.random() < DETOUR else [] for arm in range(len(order))]

    def some(self, arms: Sequence[int], tries: int, seed: int) -> dict[int, Path] | None:
        """Paths of some arms as if there were no others; None if so many `tries` fail."""
        rng = np.random.default_rng(seed)
        order, parked = [int(arm) for arm in rng.permutation(arms)], [0] * len(self.alone)
        for attempt in range(tries):
            paths, failed = self._one_after_the_other(order, parked, self._no_detours(), SOME_BUDGET, (seed, attempt))
            if failed is None:
                return paths
            if self.context.clock.expired:
                return None
            order = _next_order(order, failed, rng)
            parked = [int(k) for k in rng.integers(0, self.wait + 1, len(parked))]
        return None

    def each_alone(self, seed: int) -> bool:
        """Whether every arm finds a way as if it were the only one."""
        for attempt in range(ALONE_TRIES):
            self.context.reseed(quick_seed_of(seed, attempt))
            self.alone = []
            for arm in range(len(self.context.names)):
                path = self._plan(arm, (), (), ALONE_BUDGET, quick_seed_of(seed, attempt, arm))
                if path is None:
                    break
                self.alone.append(path)
            else:
                return True
        return False

    def _first_order(self) -> list[int]:
        """Those in most conflicts come first and keep their ways; ties as the cell has them."""
        conflicts = self.context.conflicts(self.alone, self.context.pairs())
        self.counts.root_conflicts = sum(len(instants) for instants in conflicts.values())
        mine = [sum(len(c) for pair, c in conflicts.items() if arm in pair) for arm in range(len(self.alone))]
        return sorted(range(len(self.alone)), key=lambda arm: (-mine[arm], arm))

    def _one_after_the_other(
        self,
        order: Sequence[int],
        parked: Sequence[int],
        detours: Sequence[Sequence[core.Constraint]],
        budget: float,
        key: tuple[int, int],
    ) -> tuple[dict[int, Path], int | None]:
        """A path for each arm of `order`, clear of those before it; or the arm that found none."""
        paths: dict[int, Path] = {}
        for place, arm in enumerate(order):
            before = list(paths.values())
            kept = [self._parked(other, parked[other]) for other in order[place + 1 :] if parked[other] > 0]
            kept += detours[arm]
            path = None if kept else self._alone_if_clear(arm, before)
            if path is None:
                path = self._plan(arm, kept, before, budget, quick_seed_of(*key, arm))
            if path is None:
                return {}, arm
            paths[arm] = path
        return paths, None

    def _alone_if_clear(self, arm: int, before: Sequence[Path]) -> Path | None:
        """The arm's way as if it were alone, if nobody is in it."""
        own = self.alone[arm]
        pairs = [(0, k) for k in range(1, len(before) + 1)]
        return None if self.context.conflicts([own, *before], pairs) else own

    def _no_detours(self) -> list[list[core.Constraint]]:
        return [[] for _ in self.alone]

    def _parked(self, arm: int, steps: int) -> core.Constraint:
        start = self.context.problem.start[self.context.names[arm]]
        return core.Constraint.standing(self.context.core, arm, start, start=0, end=steps)

    def _detour(self, arm: int, rng: np.random.Generator) -> list[core.Constraint]:
        """A place on the arm's own way that it keeps out of; none where that would take in its start or its goal."""
        own, radius = self.alone[arm], rng.uniform(*DETOUR_RAD)
        place = own.q[rng.integers(0, own.last + 1)]
        until = core.FOREVER if rng.random() < 0.5 else int(rng.integers(1, 2 * own.last + 2))
        if min(np.abs(own.q[[0, -1]] - place).max(axis=1)) <= radius:
            return []
        return [core.Constraint.ball(place, radius, 0, until)]

    def _plan(
        self, arm: int, constraints: Sequence[core.Constraint], others: Sequence[Path], budget: float, seed: int
    ) -> Path | None:
        self.counts.low_level_calls += 1
        experience = self.alone[arm].q if self.given else None
        path, iterations = self.context.low_level(arm, constraints, seed, budget, others=others, experience=experience)
        self.emitter.replanned(arm, len(constraints), path is not None, iterations, 1)
        return path


def _next_order(order: Sequence[int], failed: int | None, rng: np.random.Generator) -> list[int]:
    if failed is None or rng.random() >= FORWARD:
        return [int(arm) for arm in rng.permutation(sorted(order))]
    return [failed, *(arm for arm in order if arm != failed)]
