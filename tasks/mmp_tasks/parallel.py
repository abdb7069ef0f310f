"""Task `parallel`: all tool points make the same move, side by side."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.task import State
from mmp_tasks.configuration_search import ConfigurationSearch, home
from mmp_tasks.draw_options import DrawFailed, DrawOptions, draw_until_success
from mmp_tasks.ik_candidates import ToolTarget
from mmp_tasks.table import Table, turned

_LENGTH_M = (0.15, 0.25)
_FEW_ARMS = 4
"""Largest number of arms with the full length. More arms move less far, because each has less room."""
_RISE_M = 0.05
_HEIGHT_M = (0.20, 0.28)
_SPACING_M = 0.17
"""Least distance between two tool points."""
_POINTS = 6
"""Number of points that are tried for one arm."""
_ASIDE_RAD = 0.4
_MIN_REACH = 0.28
"""Smallest distance from an arm to the middle of its move, relative to the reach of the arm."""
_REACH = (0.35, 0.60)
"""Range of the distance from an arm to the middle of its move, relative to the reach of the arm."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _ArmMove:
    """The first tool point of one arm [m], and its configurations [rad]."""

    point: Float[np.ndarray, " 3"]
    start: Float[np.ndarray, " dof"]
    goal: Float[np.ndarray, " dof"]


@dataclass(frozen=True, kw_only=True)
class Parallel(DrawOptions):
    """Every tool point is displaced by the same vector, the tools pointing down as nearly as the arms reach.

    After the demonstration of parallel poses in arXiv 2509.13882.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal. Raises `MmpError` if no draw succeeds."""
        search, table = ConfigurationSearch(cell=cell, options=self, rng=rng), Table(cell)
        return draw_until_success(self, cell, lambda _: _draw(search, table))


def _draw(search: ConfigurationSearch, table: Table) -> tuple[State, State]:
    """Draws one move, and a start and goal with it for each arm. Raises `DrawFailed`."""
    turn, length, rise, height = search.rng.random(4)
    shorter = min(1.0, np.sqrt(_FEW_ARMS / max(len(table.meeting(arm)) for arm in search.cell.arms)))
    flat = (_LENGTH_M[0] + length * (_LENGTH_M[1] - _LENGTH_M[0])) * shorter
    angle = 2 * np.pi * turn
    move = np.array([flat * np.cos(angle), flat * np.sin(angle), (2 * rise - 1) * _RISE_M])
    z = table.height + _HEIGHT_M[0] + height * (_HEIGHT_M[1] - _HEIGHT_M[0])

    def move_arm(arm: Arm, others: Mapping[str, _ArmMove]) -> _ArmMove:
        starts = {name: other.start for name, other in others.items()}
        goals = {name: other.goal for name, other in others.items()}
        for far, aside in search.rng.random((_POINTS, 2)):
            point = _tool_point(table, arm, z, far, aside) - move / 2
            if any(np.linalg.norm(other.point - point) < _SPACING_M for other in others.values()):
                continue
            begin, end = ({arm.name: ToolTarget(point=p, upright=False)} for p in (point, point + move))
            with contextlib.suppress(DrawFailed):
                start = search.find(begin, home(search.cell), starts)
                goal = search.find(end, start, goals)
                return _ArmMove(point=point, start=start[arm.name], goal=goal[arm.name])
        raise DrawFailed.at(arm)

    moved = search.place_arms(move_arm)
    return {name: arm.start for name, arm in moved.items()}, {name: arm.goal for name, arm in moved.items()}


def _tool_point(table: Table, arm: Arm, z: float, far: float, aside: float) -> Float[np.ndarray, " 3"]:
    """Returns the middle of the move of an arm [m]; `far` and `aside` are random numbers from 0 to 1."""
    inward = float(np.linalg.norm(table.middle(arm) - arm.position[:2]))
    reach = (_REACH[0] + far * (_REACH[1] - _REACH[0])) * arm.robot.reach
    reach = min(reach, max(inward - table.crowded_radius(arm), _MIN_REACH * arm.robot.reach))
    forward = turned(table.forward(arm), (2 * aside - 1) * _ASIDE_RAD)
    return np.append(arm.position[:2] + reach * forward, z)
