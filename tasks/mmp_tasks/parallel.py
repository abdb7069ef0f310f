"""Task `parallel`: all tool points make the same move, side by side."""

from __future__ import annotations

from collections.abc import Mapping
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

_LENGTH_M = (0.15, 0.25)
_FEW = 4
"""More arms than these go a shorter way: each has less room."""
_RISE_M = 0.05
_HEIGHT_M = (0.20, 0.28)
_ROOM_M = 0.17
"""Between tool points."""
_MIDDLES = 6
"""So many places are tried for an arm."""
_ASIDE_RAD = 0.4
_LEAST = 0.28
_BEFORE = (0.35, 0.60)
"""The middle of each move is so many reaches before its arm."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Moved:
    """An arm: where its tool point is at first [m], and its configurations [rad]."""

    point: Float[np.ndarray, " 3"]
    start: Float[np.ndarray, " dof"]
    goal: Float[np.ndarray, " dof"]


@dataclass(frozen=True, kw_only=True)
class Parallel(Posing):
    """Every tool point is displaced by the same vector, the tools pointing down as nearly as the arms reach.

    After the demonstration of parallel poses in arXiv 2509.13882.
    """

    called: ClassVar[str] = "parallel"

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """A start and a goal. Raises `MmpError` where no draw succeeds."""
        table = Table(cell)
        return self.first(cell, lambda _: self._draw(cell, table, rng))

    def _draw(self, cell: Cell, table: Table, rng: np.random.Generator) -> tuple[State, State]:
        """One move, and arm after arm a place for it. Raises `DrawFailed`."""
        turn, length, rise, height = rng.random(4)
        flat = (_LENGTH_M[0] + length * (_LENGTH_M[1] - _LENGTH_M[0])) * min(1.0, np.sqrt(_FEW / len(cell.arms)))
        angle = 2 * np.pi * turn
        way = np.array([flat * np.cos(angle), flat * np.sin(angle), (2 * rise - 1) * _RISE_M])
        z = table.height + _HEIGHT_M[0] + height * (_HEIGHT_M[1] - _HEIGHT_M[0])
        moved = self.in_turn(cell, rng, lambda arm, others: self._move(cell, table, arm, (way, z), rng, others))
        return {name: arm.start for name, arm in moved.items()}, {name: arm.goal for name, arm in moved.items()}

    def _move(
        self,
        cell: Cell,
        table: Table,
        arm: Arm,
        move: tuple[Float[np.ndarray, " 3"], float],
        rng: np.random.Generator,
        others: Mapping[str, _Moved],
    ) -> _Moved:
        """One arm beside others with the same `move` (vector, height of its middle [m]). Raises `DrawFailed`."""
        way, z = move
        points = [other.point for other in others.values()]
        starts = {name: other.start for name, other in others.items()}
        goals = {name: other.goal for name, other in others.items()}
        for far, aside in rng.random((_MIDDLES, 2)):
            inward = float(np.linalg.norm(table.center - arm.position[:2]))
            reach = (_BEFORE[0] + far * (_BEFORE[1] - _BEFORE[0])) * arm.robot.reach
            reach = min(reach, max(inward - table.crowd, _LEAST * arm.robot.reach))
            forward = turned(table.forward(arm), (2 * aside - 1) * _ASIDE_RAD)
            point = np.append(arm.position[:2] + reach * forward, z) - way / 2
            if points and np.linalg.norm(np.array(points) - point, axis=1).min() < _ROOM_M:
                continue
            begin, end = ({arm.name: ToolTarget(point=p, upright=False)} for p in (point, point + way))
            try:
                start = self.stance(cell, begin, rng, home(cell), starts)
                goal = self.stance(cell, end, rng, start, goals)
            except DrawFailed:
                continue
            return _Moved(point=point, start=start[arm.name], goal=goal[arm.name])
        raise DrawFailed.at(arm)
