"""Task `crossing`: tool points swap sides."""

from __future__ import annotations

import contextlib
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

_OFFSET_M = (0.12, 0.18)
"""Range of the distance from a tool point to the middle between the two."""
_HEIGHT_M = (0.18, 0.30)
_ASKEW_RAD = 0.6
_SPACING_M = 0.15
"""Least distance between the tool points of different pairs."""
_RANDOM_M = 0.5
"""Random term that is added to the distance of two arms when partners are chosen."""
_PARTNERS = 3
"""Number of partners that are tried for one arm."""
_POINTS = 4
"""Number of point pairs that are tried for one pair of arms."""
_REACH_FACTOR = 0.85
"""Share of both reaches within which partners swap their tool points."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Placed:
    """Start and goal of the arms that have a partner already, and all their tool points [m]."""

    start: State
    goal: State
    points: tuple[Float[np.ndarray, " 3"], ...]


@dataclass(frozen=True, kw_only=True)
class Crossing(DrawOptions):
    """Arms in pairs, side by side with the tools down: each tool point goes to where its partner's was.

    After the demonstration of the same name in arXiv 2509.13882. Pairs are drawn at random among the arms that reach
    far enough; an arm without a partner goes from one side of its base to the other. The line between the two tools is
    across the one between the two bases, so that the arms are side by side and their straight paths meet.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal. Raises `MmpError` if no draw succeeds."""
        search, table = ConfigurationSearch(cell=cell, options=self, rng=rng), Table(cell)
        return draw_until_success(self, cell, lambda _: _draw(search, table))


def _draw(search: ConfigurationSearch, table: Table) -> tuple[State, State]:
    """Draws pair after pair, each beside the pairs before it. Raises `DrawFailed`."""
    placed = _Placed(start={}, goal={}, points=())
    left = [search.cell.arms[k] for k in search.rng.permutation(len(search.cell.arms))]
    while left:
        arm = left.pop()
        for pair in [(arm, other) for other in _partners(arm, left, search.rng)] + [(arm,)]:
            found = _add_pair(search, table, pair, placed)
            if found is not None:
                placed = found
                left = [other for other in left if other not in pair]
                break
        else:
            raise DrawFailed.at(arm)
    return placed.start, placed.goal


def _add_pair(search: ConfigurationSearch, table: Table, pair: tuple[Arm, ...], placed: _Placed) -> _Placed | None:
    """Returns the arms `placed` so far and the pair, or None if no point pair succeeds."""
    for _ in range(_POINTS):
        points = _swapped_points(table, pair, search.rng)
        if placed.points and min(np.linalg.norm(a - b) for a in points for b in placed.points) < _SPACING_M:
            continue
        starts, goals = (
            {arm.name: ToolTarget(point=point, upright=False) for arm, point in zip(pair, order, strict=False)}
            for order in (points, points[::-1])
        )
        with contextlib.suppress(DrawFailed):
            start = search.find(starts, home(search.cell), placed.start)
            goal = search.find(goals, start, placed.goal)
            return _Placed(start=start, goal=goal, points=placed.points + points)
    return None


def _partners(arm: Arm, others: list[Arm], rng: np.random.Generator) -> list[Arm]:
    """Returns arms to swap with, preferably neighbours: in a big ring the middle has no room for all pairs."""
    far = {
        other.name: np.linalg.norm(other.position - arm.position) + _RANDOM_M * share
        for other, share in zip(others, rng.random(len(others)), strict=True)
    }
    return sorted((other for other in others if _can_swap(arm, other)), key=lambda other: far[other.name])[:_PARTNERS]


def _can_swap(arm: Arm, other: Arm) -> bool:
    between = float(np.linalg.norm(arm.position[:2] - other.position[:2]))
    share = between / (arm.robot.reach + other.robot.reach)
    return all(np.hypot(share * a.robot.reach, _OFFSET_M[0]) <= _REACH_FACTOR * a.robot.reach for a in (arm, other))


def _swapped_points(
    table: Table, pair: tuple[Arm, ...], rng: np.random.Generator
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Returns the two points [m] that a pair, or a single arm, swaps."""
    arm, *others = pair
    length, height, askew, side = rng.random(4)
    if others:
        share = arm.robot.reach / (arm.robot.reach + others[0].robot.reach)
        along = others[0].position[:2] - arm.position[:2]
        middle = arm.position[:2] + share * along
        along = along / np.linalg.norm(along)
    else:
        along = table.forward(arm)
        middle = arm.position[:2] + 0.5 * arm.robot.reach * along
    across = turned(along, np.pi / 2 + (2 * askew - 1) * _ASKEW_RAD) * (1.0 if side < 0.5 else -1.0)
    offset = (_OFFSET_M[0] + length * (_OFFSET_M[1] - _OFFSET_M[0])) * across
    z = table.height + _HEIGHT_M[0] + height * (_HEIGHT_M[1] - _HEIGHT_M[0])
    return np.append(middle + offset, z), np.append(middle - offset, z)
