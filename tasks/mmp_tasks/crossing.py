"""Task `crossing`: tool points swap sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_tasks.drawing import DrawFailed
from mmp_tasks.ik_candidates import ToolTarget
from mmp_tasks.stances import Posing, home
from mmp_tasks.table import Table, turned
from mmp_tasks.task import State

_APART_M = (0.12, 0.18)
"""How far the tool points are from the middle between them."""
_HEIGHT_M = (0.18, 0.30)
_ASKEW_RAD = 0.6
_ROOM_M = 0.15
"""Between the tool points of different pairs."""
_WHIM_M, _ASKED = 0.5, 3
_SIDES = 4
"""So many places are tried for a pair."""
_STRETCH = 0.85
"""Arms are partners where what they swap is within this part of both reaches."""


@dataclass(frozen=True, kw_only=True)
class Crossing(Posing):
    """Arms in pairs, side by side with the tools down: each tool point goes to where its partner's was.

    After the demonstration of the same name in arXiv 2509.13882. Pairs are drawn at random among the arms that reach
    far enough; an arm without a partner goes from one side of its base to the other. The line between the two tools is
    across the one between the two bases, so that the arms are not behind each other but their straight ways meet.
    """

    called: ClassVar[str] = "crossing"

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """A start and a goal. Raises `MmpError` where no draw succeeds."""
        table = Table(cell)
        return self.first(cell, lambda _: self._draw(cell, table, rng))

    def _draw(self, cell: Cell, table: Table, rng: np.random.Generator) -> tuple[State, State]:
        """Pair after pair, each beside those before it. Raises `DrawFailed`."""
        start: State = {}
        goal: State = {}
        points: list[Float[np.ndarray, " 3"]] = []
        left = [cell.arms[k] for k in rng.permutation(len(cell.arms))]
        while left:
            arm = left.pop()
            for pair in [(arm, other) for other in _partners(arm, left, rng)] + [(arm,)]:
                found = self._pair(cell, table, pair, rng, (start, goal), points)
                if found is not None:
                    start, goal = found
                    left = [other for other in left if other not in pair]
                    break
            else:
                raise DrawFailed.at(arm)
        return start, goal

    def _pair(
        self,
        cell: Cell,
        table: Table,
        pair: tuple[Arm, ...],
        rng: np.random.Generator,
        beside: tuple[State, State],
        points: list[Float[np.ndarray, " 3"]],
    ) -> tuple[State, State] | None:
        """`beside` and the pair, of whose tool points the list is told."""
        for _ in range(_SIDES):
            sides = _sides(table, pair, rng)
            if points and min(np.linalg.norm(a - b) for a in sides for b in points) < _ROOM_M:
                continue
            starts, goals = (
                {arm.name: ToolTarget(point=p, upright=False) for arm, p in zip(pair, way, strict=False)}
                for way in (sides, sides[::-1])
            )
            try:
                start = self.stance(cell, starts, rng, home(cell), beside[0])
                goal = self.stance(cell, goals, rng, start, beside[1])
            except DrawFailed:
                continue
            points += sides
            return start, goal
        return None


def _partners(arm: Arm, others: list[Arm], rng: np.random.Generator) -> list[Arm]:
    """Those that an arm can swap with, neighbours rather first: in a big ring the middle has no room for all."""
    far = {
        other.name: np.linalg.norm(other.position - arm.position) + _WHIM_M * whim
        for other, whim in zip(others, rng.random(len(others)), strict=True)
    }
    return sorted((other for other in others if _can_swap(arm, other)), key=lambda other: far[other.name])[:_ASKED]


def _can_swap(arm: Arm, other: Arm) -> bool:
    between = float(np.linalg.norm(arm.position[:2] - other.position[:2]))
    share = between / (arm.robot.reach + other.robot.reach)
    return all(np.hypot(share * a.robot.reach, _APART_M[0]) <= _STRETCH * a.robot.reach for a in (arm, other))


def _sides(
    table: Table, pair: tuple[Arm, ...], rng: np.random.Generator
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """The two points that are swapped."""
    arm, *others = pair
    apart, height, askew, side = rng.random(4)
    if others:
        share = arm.robot.reach / (arm.robot.reach + others[0].robot.reach)
        along = others[0].position[:2] - arm.position[:2]
        middle = arm.position[:2] + share * along
        along = along / np.linalg.norm(along)
    else:
        along = table.forward(arm)
        middle = arm.position[:2] + 0.5 * arm.robot.reach * along
    across = turned(along, np.pi / 2 + (2 * askew - 1) * _ASKEW_RAD) * (1.0 if side < 0.5 else -1.0)
    offset = (_APART_M[0] + apart * (_APART_M[1] - _APART_M[0])) * across
    z = table.height + _HEIGHT_M[0] + height * (_HEIGHT_M[1] - _HEIGHT_M[0])
    return np.append(middle + offset, z), np.append(middle - offset, z)
