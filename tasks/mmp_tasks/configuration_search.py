"""Search for configurations that bring each tool to its target, with the required clearance from each other."""

from __future__ import annotations

import itertools
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.task import State
from mmp_tasks.draw_options import DrawFailed, DrawOptions
from mmp_tasks.ik_candidates import GUESS_TOLERANCE_M, IkCandidates, ToolTarget
from mmp_tasks.required_clearance import RequiredClearance

T = TypeVar("T")

_MAX_SELECTED = 3000
"""Largest number of candidates that one backtracking search selects."""
_MAX_EVICTIONS = 2
"""Largest number of neighbours that are evicted for the sake of one arm."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ConfigurationSearch:
    """A search by inverse kinematics in `cell`; `options` has the clearances and the candidates of one arm."""

    cell: Cell
    options: DrawOptions
    rng: np.random.Generator

    def within(self, cell: Cell) -> ConfigurationSearch:
        """Returns the same search in another cell. Both share the random generator."""
        return replace(self, cell=cell)

    def find(self, targets: Mapping[str, ToolTarget], near: State, others: State | None = None) -> State:
        """Returns configurations that bring the tools to their targets, together with those of `others`.

        Args:
            targets: arm name -> target of its tool point.
            near: arm name -> preferred configuration [dof] [rad].
            others: configurations of the arms that are placed already. All arms keep the clearance from them.

        Raises:
            DrawFailed: if the search finds none.
        """
        required = self._required
        placed = dict(others or {})
        candidates: list[IkCandidates] = []
        for name, target in targets.items():
            found = IkCandidates(self.cell.arm(name), target, required, placed)
            if not found.find(near[name], self.options.tries, self.rng):
                raise DrawFailed.at(found.arm)
            candidates.append(found)
        return {**placed, **_Backtracking(required, candidates).run()}

    def place_arms(self, attempt: Callable[[Arm, Mapping[str, T]], T]) -> dict[str, T]:
        """Returns the result of `attempt(arm, results of the arms before)` for every arm.

        When an attempt raises `DrawFailed`, one of the two nearest arms with a result is evicted and queued again.

        Raises:
            DrawFailed: if an arm still fails after `_MAX_EVICTIONS` evictions, or beside no other arm.
        """
        results: dict[str, T] = {}
        waiting, evictions = deque(self.cell.arms), Counter[str]()
        while waiting:
            arm = waiting.popleft()
            try:
                results[arm.name] = attempt(arm, results)
            except DrawFailed:
                if evictions[arm.name] == _MAX_EVICTIONS or not results:
                    raise
                evictions[arm.name] += 1
                waiting.appendleft(arm)
                nearest = sorted(results, key=lambda n: np.linalg.norm(self.cell.arm(n).position - arm.position))[:2]
                evicted = nearest[int(self.rng.random() * len(nearest))]
                waiting.append(self.cell.arm(evicted))
                del results[evicted]
        return {name: results[name] for name in self.cell.arm_names}

    def require(self, state: State, where: str) -> State:
        """Returns `state`. Raises `DrawFailed` with the words `where` if it does not keep the clearances."""
        required = self._required
        placed: dict[str, Float[np.ndarray, " dof"]] = {}
        for arm in self.cell.arms:
            if not required.is_kept(arm.name, state[arm.name], placed):
                raise DrawFailed.at(arm, f" {where}")
            placed[arm.name] = state[arm.name]
        return state

    @property
    def _required(self) -> RequiredClearance:
        return RequiredClearance(cell=self.cell, options=self.options)


class _Backtracking:
    """A depth-first search for one candidate of each arm, all with the required clearance from each other.

    Two candidates are compared by their initial guesses, and exactly once both are solved.
    """

    def __init__(self, required: RequiredClearance, candidates: list[IkCandidates]) -> None:
        self._required = required
        self._candidates = sorted(candidates, key=lambda one: len(one.q))
        self._deepest = self._selected = 0
        self._compatible: dict[tuple[int, int], Bool[np.ndarray, "n m"]] = {}
        for (a, one), (b, other) in itertools.combinations(enumerate(self._candidates), 2):
            slack = required.slack_between(one.arm.name, one.q, other.arm.name, other.q)
            self._compatible[a, b] = slack > -GUESS_TOLERANCE_M
            self._compatible[b, a] = self._compatible[a, b].T  # a view of the same array

    def run(self) -> State:
        """Returns a configuration of each arm. Raises `DrawFailed` with the deepest arm of the search."""
        choice = self._extend([])
        if choice is None:
            raise DrawFailed.at(self._candidates[self._deepest].arm)
        return {one.arm.name: frozen_array(one.q[k]) for one, k in zip(self._candidates, choice, strict=True)}

    def _extend(self, choice: list[int]) -> list[int] | None:
        """Returns the choice of the first arms with solved candidates of all others, or None."""
        a = len(choice)
        if a == len(self._candidates):
            return choice
        self._deepest = max(self._deepest, a)
        for k in range(len(self._candidates[a].q)):
            if self._fits(a, k, choice) and self._selected < _MAX_SELECTED:
                self._selected += 1
                self._solve(a, k)
                if self._fits(a, k, choice) and (complete := self._extend([*choice, k])):
                    return complete
        return None

    def _fits(self, a: int, k: int, choice: list[int]) -> bool:
        return not self._candidates[a].refused[k] and all(self._compatible[a, b][k, n] for b, n in enumerate(choice))

    def _solve(self, a: int, k: int) -> None:
        """Solves candidate `k` of arm `a`, and compares it with the solved candidates of the others."""
        mine = self._candidates[a]
        if mine.solved[k]:
            return
        mine.solve(k)
        for b, other in enumerate(self._candidates):
            if b != a and mine.solved[k] and other.solved.any():
                slack = self._required.slack_between(mine.arm.name, mine.q[[k]], other.arm.name, other.q[other.solved])
                self._compatible[a, b][k, other.solved] = slack[0] >= 0


def tucked(cell: Cell) -> State:
    """Returns the tucked configuration of every arm."""
    return {arm.name: arm.robot.tucked for arm in cell.arms}


def home(cell: Cell) -> State:
    """Returns the home configuration of every arm."""
    return {arm.name: arm.robot.home for arm in cell.arms}
