"""Whether an arm, alone in its cell, can go from its start to its goal."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.cell import Cell
from mmp_env.model.margins import DEFAULT_MARGIN_M, MOST_SLACK_M

_ITERATIONS = 3000
"""Largest number of iterations of RRT-Connect."""
_SEED = 0
_FOREVER_S = 1e10


def has_path_alone(cell: Cell, arm: str, start: Float[np.ndarray, " dof"], goal: Float[np.ndarray, " dof"]) -> bool:
    """Returns whether RRT-Connect finds a path for one arm beside the obstacles, without the other arms.

    Joint limits and obstacles can cut the space of an arm into parts. Two draws may lie in different parts: an upper
    arm that cannot pass the table, with joint limits that forbid the way over the back.
    """
    margin = DEFAULT_MARGIN_M
    levels = core.Levels(margin + MOST_SLACK_M / 2, margin + MOST_SLACK_M / 4, upright=-margin)
    search = core.CompositeSearch(
        cell.alone(arm).collision.core,
        start=np.ascontiguousarray(start, dtype=float),
        goals=np.ascontiguousarray(goal, dtype=float)[None],
        samples=levels,
        edges=levels,
        seed=_SEED,
    )
    return search.grow(_ITERATIONS, core.Clock(_FOREVER_S)) is not None
