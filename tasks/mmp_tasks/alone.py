"""Whether each arm, alone in its cell, can go from its start to its goal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.margins import DEFAULT_MARGIN_M, MOST_SLACK_M
from mmp_env.model.task import State

_ITERATIONS = 3000
"""Largest number of iterations of RRT-Connect."""
_SEED = 0
_FOREVER_S = 1e10


def arm_without_path(cell: Cell, start: State, goal: State) -> Arm | None:
    """Returns the first arm that finds no path from its start to its goal beside the obstacles of a cell, or None.

    Joint limits and obstacles can cut the space of an arm into parts. Two draws may lie in different parts: an upper
    arm that cannot pass the table, with joint limits that forbid the way over the back.
    """
    for arm in cell.arms:
        if not _has_path(_alone(cell, arm), start[arm.name], goal[arm.name]):
            return arm
    return None


def _alone(cell: Cell, arm: Arm) -> Cell:
    mine = [{link for link in each.may_touch if link.startswith(f"{arm.name}/")} for each in cell.obstacles]
    obstacles = [replace(each, may_touch=frozenset(links)) for each, links in zip(cell.obstacles, mine, strict=True)]
    return replace(cell, arms=(arm,), obstacles=tuple(obstacles), joints=None)


def _has_path(alone: Cell, start: Float[np.ndarray, " dof"], goal: Float[np.ndarray, " dof"]) -> bool:
    margin = DEFAULT_MARGIN_M
    levels = core.Levels(margin + MOST_SLACK_M / 2, margin + MOST_SLACK_M / 4, upright=-margin)
    search = core.CompositeSearch(
        alone.collision.core,
        start=np.ascontiguousarray(start, dtype=float),
        goals=np.ascontiguousarray(goal, dtype=float)[None],
        samples=levels,
        edges=levels,
        seed=_SEED,
    )
    return search.grow(_ITERATIONS, core.Clock(_FOREVER_S)) is not None
