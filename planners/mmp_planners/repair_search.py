"""Local repair: plans arm by arm, and mends what fails where it fails.

Prioritized planning begins again when one arm finds no path. The more arms, the more often that happens, although each
arm meets few others. Here an arm without a path takes one that passes through some of the arms that block it, and these
are planned again: rip-up and reroute, as in the routing of circuits (Dees, Karger: Automated rip-up and reroute
techniques, DAC 1982). Arms that block each other again are coupled, which means planned together in their composite
space, and others go around (van den Berg, Snoeyink, Lin, Manocha: Centralized path planning for multiple robots:
Optimal decoupling into sequential plans, RSS 2009).
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection, Generator, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_planners.arm_bounds import farthest_point
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.counts import SingleArmCounts
from mmp_planners.planning_context import Path, PlanningContext
from mmp_planners.seeds import quick_seed_of

REPAIRS_PER_ARM = 5
"""Largest number of repairs in an attempt, for each arm of the cell."""
DROP_PROBABILITY = 0.5
"""Probability that one of the arms that block another is planned again."""
PARKED_PROBABILITY = 0.5
"""Probability that the blocked arm must avoid the start of an arm that is planned again, for a random time."""
COUPLED_ITERATIONS = 1000
"""Largest number of iterations of a composite search."""
WORK_PER_COUPLING = 5000
"""Work of planning some arms together, about its microseconds."""
COUPLED_SHORTCUTS = 60
"""Number of attempts to shorten the paths of coupled arms."""


@dataclass(kw_only=True, eq=False)
class RepairSearch:
    """Attempts to plan all arms with local repair.

    Attributes:
        context: the problem on its time grid.
        counts: counts of the run.
        emitter: emits the events of the search.
        wait: longest time for which an arm must avoid the start of another [steps].
        patience: number of times that two arms block each other before they are coupled.
        most_coupled: largest number of arms that are coupled.
        failed_attempts: number of attempts that ended without a plan that could be proved.
    """

    context: PlanningContext
    counts: SingleArmCounts
    emitter: EventEmitter
    wait: int
    patience: int
    most_coupled: int
    failed_attempts: int = 0

    def plans(self, seed: int, own: Sequence[Path]) -> Iterator[Plan | None]:
        """Yields None after each arm, and the plan of each attempt that has one, not certified yet, until time is up.

        Args:
            seed: seed of the attempts.
            own: an independent path of each arm.
        """
        while not self.context.clock.expired:
            self.emitter.search_started(self.failed_attempts, seed)
            paths = yield from _Attempt(self, own, quick_seed_of(seed, self.failed_attempts)).steps()
            if paths is not None:
                yield self.context.plan(paths)
            self.counts.restarts += 1
            self.failed_attempts += 1

    @cached_property
    def near(self) -> list[list[int]]:
        """For each arm the others that it can meet."""
        arms, spheres = self.context.problem.cell.arms, self.context.problem.cell.spheres
        radii = [farthest_point(arm, spheres) for arm in arms]
        apart = self.context.conflict_distance

        def meet(a: int, b: int) -> bool:
            return bool(np.linalg.norm(arms[a].position - arms[b].position) < radii[a] + radii[b] + apart)

        return [[b for b in range(len(arms)) if b != a and meet(a, b)] for a in range(len(arms))]


class _Attempt:
    """One attempt: the paths so far, clear of each other, and which pairs of arms blocked each other how often."""

    def __init__(self, search: RepairSearch, own: Sequence[Path], seed: int) -> None:
        self._search, self._context, self._own, self._seed = search, search.context, own, seed
        self._rng = np.random.default_rng(seed)
        self._paths: dict[int, Path] = {}
        self._coupled: dict[int, frozenset[int]] = {}
        self._blocked = Counter[frozenset[int]]()
        self._calls = 0

    def steps(self) -> Generator[None, None, list[Path] | None]:
        """Yields after each arm. Returns a path of each arm, or None after too many repairs."""
        count, repairs = len(self._own), 0
        waiting = deque(self._shuffled(range(count)))
        while waiting:
            arm = waiting.popleft()
            if arm in self._paths:
                continue
            path = self._path(arm, self._planned_near(arm))
            yield
            if path is not None:
                self._paths[arm] = path
                continue
            repairs += 1
            dropped = None if repairs > REPAIRS_PER_ARM * count else self._repair(arm)
            if dropped is None or self._context.clock.expired:
                return None
            waiting.extendleft(self._shuffled(dropped))
        return [self._paths[arm] for arm in range(count)]

    def _repair(self, arm: int) -> list[int] | None:
        """Gives a blocked arm a path. Returns the arms that lose theirs, or None if nothing helps."""
        before = self._planned_near(arm)
        blocking = [b for b in before if not self._is_clear(self._own[arm], [b])] or before
        for b in blocking:
            self._blocked[frozenset((arm, b))] += 1
        worst = max(blocking, key=lambda b: (self._blocked[frozenset((arm, b))], self._rng.random()))
        if self._blocked[frozenset((arm, worst))] > self._search.patience:
            dropped = self._couple(frozenset((arm, worst)) | self._coupled.get(worst, frozenset()))
            if dropped is not None:
                return dropped
        some = [b for b in blocking if self._rng.random() < DROP_PROBABILITY] or blocking
        for chosen in (some, before):
            again = sorted({c for b in chosen for c in self._coupled.get(b, {b})})
            parked = [self._parked(b) for b in again if self._rng.random() < PARKED_PROBABILITY]
            path = self._path(arm, [b for b in before if b not in again], parked)
            if path is not None:
                self._drop(again)
                self._paths[arm] = path
                return again
        return None

    def _couple(self, group: frozenset[int]) -> list[int] | None:
        """Plans some arms together. Returns the arms in the way, which lose their paths, or None without a plan."""
        found = self._together(sorted(group)) if len(group) <= self._search.most_coupled else None
        if found is None:
            return None
        self._drop(group)
        self._paths |= found
        self._coupled |= dict.fromkeys(group, group)
        near = {b for a in group for b in self._planned_near(a)} - group
        in_the_way = {b for b in near if not self._is_clear(self._paths[b], sorted(group))}
        again = sorted({c for b in in_the_way for c in self._coupled.get(b, {b})})
        self._drop(again)
        return again

    def _drop(self, arms: Collection[int]) -> None:
        """Forgets the paths of some arms. Arms that were coupled with them keep theirs."""
        for arm in arms:
            self._paths.pop(arm, None)
            for other in self._coupled.get(arm, ()):
                self._coupled.pop(other, None)

    def _together(self, arms: list[int]) -> dict[int, Path] | None:
        """Returns paths of some arms, clear of each other, from a composite search; None if it finds none."""
        problem, names = self._context.problem, [self._context.names[arm] for arm in arms]
        self._calls += 1
        search = core.CompositeSearch(
            self._context.core,
            start=np.concatenate([problem.start[name] for name in names]),
            goals=np.concatenate([problem.goal[name] for name in names])[None],
            samples=problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
            edges=problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            seed=quick_seed_of(self._seed, self._calls),
            arms=arms,
        )
        corners = search.grow(COUPLED_ITERATIONS, self._context.clock)
        self._context.work += WORK_PER_COUPLING
        if corners is None:
            return None
        steps = [self._context.max_step[arm] for arm in arms]
        rows, _ = core.shortcut(
            self._context.core,
            _at_full_speed(corners, steps),
            steps,
            goals=[problem.goal[name][None] for name in names],
            levels=problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            groups=[0] * len(arms),
            settings=core.ShortcutSettings(attempts=COUPLED_SHORTCUTS),
            seed=quick_seed_of(self._seed, self._calls, 0),
            clock=self._context.clock,
            arms=arms,
        )
        return {arm: self._context.path(arm, part) for arm, part in zip(arms, rows, strict=True)}

    def _path(self, arm: int, others: Sequence[int], constraints: Sequence[core.Constraint] = ()) -> Path | None:
        """Returns a path of one arm that is clear of others, its own path if possible."""
        if not constraints and self._is_clear(self._own[arm], others):
            return self._own[arm]
        self._calls += 1
        self._search.counts.low_level_calls += 1
        path, iterations = self._context.low_level(
            arm, constraints, quick_seed_of(self._seed, self._calls), others=[self._paths[b] for b in others]
        )
        self._search.emitter.replanned(arm, len(constraints), path is not None, iterations, 1)
        return path

    def _parked(self, arm: int) -> core.Constraint:
        start = self._context.problem.start[self._context.names[arm]]
        until = int(self._rng.integers(1, self._search.wait + 2))
        return core.Constraint.standing(self._context.core, arm, start, start=0, end=until)

    def _is_clear(self, path: Path, others: Sequence[int]) -> bool:
        paths = [path, *(self._paths[b] for b in others)]
        return not others or not self._context.conflicts(paths, [(0, k) for k in range(1, len(paths))])

    def _planned_near(self, arm: int) -> list[int]:
        return [b for b in self._search.near[arm] if b in self._paths]

    def _shuffled(self, arms: Collection[int]) -> list[int]:
        return [int(arm) for arm in self._rng.permutation(sorted(arms))]


def _at_full_speed(
    corners: Float[np.ndarray, "n _"], steps: Sequence[Float[np.ndarray, "_dof"]]
) -> list[Float[np.ndarray, "k _"]]:
    """Returns the configurations [k, dof] of each arm on the grid, through corners [n, all joints].

    Args:
        corners: a path of all arms.
        steps: largest move of each joint of each arm in one step.
    """
    moves = np.abs(np.diff(corners, axis=0)) / np.concatenate(steps)
    count = np.maximum(np.ceil(moves.max(axis=1) - 1e-6), 1)
    at = np.concatenate([[0], np.cumsum(count)])
    rows = np.column_stack([np.interp(np.arange(at[-1] + 1), at, joint) for joint in corners.T])
    ends = np.cumsum([len(step) for step in steps])[:-1]
    return [np.ascontiguousarray(part) for part in np.split(rows, ends, axis=1)]
