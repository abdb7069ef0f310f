"""Stances: configurations of arms that bring each tool to its place, valid and clear of each other."""

from __future__ import annotations

import itertools
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_tasks.drawing import DrawFailed, Drawing
from mmp_tasks.ik_candidates import NEARLY_M, ToolTarget, Ways
from mmp_tasks.room import Room
from mmp_tasks.task import State

T = TypeVar("T")

_LOOKED_AT = 3000
"""Choices before a search for compatible configurations is given up."""
_GIVING_WAY = 2
"""So often others have another turn for the sake of one arm."""


@dataclass(frozen=True, kw_only=True)
class Posing(Drawing):
    """A task that poses arms by inverse kinematics: up to `tries` ways are looked at for one arm and place."""

    def stance(
        self,
        cell: Cell,
        places: Mapping[str, ToolTarget],
        rng: np.random.Generator,
        near: State,
        beside: State | None = None,
    ) -> State:
        """Configurations of the arms in `places`, each with its tool at its place, near to `near`.

        They are clear of each other and of the arms `beside`, which come back with them. Raises `DrawFailed`.
        """
        room = self.room(cell)
        standing = dict(beside or {})
        all_ways: list[Ways] = []
        for name, place in places.items():
            ways = Ways(cell.arm(name), place, room, standing)
            if not ways.find(near[name], self.tries, rng):
                raise DrawFailed.at(ways.arm)
            all_ways.append(ways)
        return {**standing, **_Company(room, all_ways).found()}

    def in_turn(
        self, cell: Cell, rng: np.random.Generator, attempt: Callable[[Arm, Mapping[str, T]], T]
    ) -> dict[str, T]:
        """What `attempt` makes of each arm, given what it made of those that had their turn.

        Where it raises `DrawFailed`, one of the nearest two loses what was made of it and waits for another turn: up
        to `_GIVING_WAY` times for the sake of one arm. Raises `DrawFailed` after that.
        """
        made: dict[str, T] = {}
        waiting, asked = deque(cell.arms), Counter[str]()
        while waiting:
            arm = waiting.popleft()
            try:
                made[arm.name] = attempt(arm, made)
            except DrawFailed:
                if asked[arm.name] == _GIVING_WAY or not made:
                    raise
                asked[arm.name] += 1
                waiting.appendleft(arm)
                nearest = sorted(made, key=lambda other: np.linalg.norm(cell.arm(other).position - arm.position))[:2]
                other = nearest[int(rng.random() * len(nearest))]
                waiting.append(cell.arm(other))
                del made[other]
        return {name: made[name] for name in cell.arm_names}

    def require(self, cell: Cell, state: State, which: str) -> State:
        """`state` itself. Raises `DrawFailed` where it does not keep the clearances in the cell."""
        room = self.room(cell)
        standing: dict[str, Float[np.ndarray, " dof"]] = {}
        for arm in cell.arms:
            if not room.has(arm.name, state[arm.name], standing):
                raise DrawFailed.at(arm, f" {which}")
            standing[arm.name] = state[arm.name]
        return state


class _Company:
    """A search, depth first, for a way of each arm, all clear of each other, early ones rather.

    What two ways are to each other is known roughly as long as one is not solved.
    """

    def __init__(self, room: Room, all_ways: list[Ways]) -> None:
        self._room = room
        self._ways = sorted(all_ways, key=lambda ways: len(ways.q))
        self._farthest = self._looked_at = 0
        self._clear: dict[tuple[int, int], Bool[np.ndarray, "n m"]] = {}
        for (a, one), (b, other) in itertools.combinations(enumerate(self._ways), 2):
            self._clear[a, b] = room.slack_between(one.arm.name, one.q, other.arm.name, other.q) > -NEARLY_M
            self._clear[b, a] = self._clear[a, b].T  # a view of the same

    def found(self) -> State:
        """A configuration of each arm. Raises `DrawFailed` with the arm that the search never came beyond."""
        numbers = self._extended([])
        if numbers is None:
            raise DrawFailed.at(self._ways[self._farthest].arm)
        return {ways.arm.name: frozen_array(ways.q[k]) for ways, k in zip(self._ways, numbers, strict=True)}

    def _extended(self, numbers: list[int]) -> list[int] | None:
        """Numbers of solved ways of all arms, those of the first ones given; None where nothing goes with these."""
        a = len(numbers)
        if a == len(self._ways):
            return numbers
        self._farthest = max(self._farthest, a)
        for k in range(len(self._ways[a].q)):
            if self._goes_with(a, k, numbers) and self._looked_at < _LOOKED_AT:
                self._looked_at += 1
                self._solve(a, k)
                if self._goes_with(a, k, numbers) and (out := self._extended([*numbers, k])):
                    return out
        return None

    def _goes_with(self, a: int, k: int, numbers: list[int]) -> bool:
        return not self._ways[a].refused[k] and all(self._clear[a, b][k, other] for b, other in enumerate(numbers))

    def _solve(self, a: int, k: int) -> None:
        """Solves way `k` of arm `a`, and finds out which solved ways of others it is clear of."""
        mine = self._ways[a]
        if mine.solved[k]:
            return
        mine.solve(k)
        for b, ways in enumerate(self._ways):
            if b != a and mine.solved[k] and ways.solved.any():
                slack = self._room.slack_between(mine.arm.name, mine.q[[k]], ways.arm.name, ways.q[ways.solved])
                self._clear[a, b][k, ways.solved] = slack[0] >= 0


def tucked(cell: Cell) -> State:
    """Every arm in the tucked pose of its robot."""
    return {arm.name: arm.robot.tucked for arm in cell.arms}


def home(cell: Cell) -> State:
    """Every arm in the home pose of its robot."""
    return {arm.name: arm.robot.home for arm in cell.arms}
