"""Candidates for the goal of an arm: which of them a path ends at, and which of many a search knows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mmp_env.model.problem import Problem

_NEAREST_SHARE = 0.75
"""Share of the nearest candidates among those that a search knows; the others are spread over all."""


def nearest(candidates: Float[np.ndarray, "n dof"], q: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "dof"]:
    """Returns the candidate with the least largest joint difference to `q` [rad]."""
    return candidates[0] if len(candidates) == 1 else candidates[np.abs(candidates - q).max(axis=1).argmin()]


def ending_at(problem: Problem, positions: Mapping[str, Float[np.ndarray, "k _"]]) -> Problem:
    """Returns the problem with the candidates nearest to the last rows of trajectories, by arm name, as its goal."""
    if problem.single_goals:
        return problem
    return problem.choosing({name: nearest(rows, positions[name][-1]) for name, rows in problem.goals.items()})


def few(candidates: Float[np.ndarray, "n dof"], most: int) -> Float[np.ndarray, "m dof"]:
    """Returns at most that many of candidates that are sorted by distance: the nearest, and some of the others."""
    if len(candidates) > most:
        near = int(_NEAREST_SHARE * most)
        others = np.linspace(near, len(candidates) - 1, most - near).astype(int)
        candidates = candidates[np.concatenate([np.arange(near), others])]
    return np.ascontiguousarray(candidates)
