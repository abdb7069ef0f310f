"""Levels of searches in the composite space, all joints of all arms."""

from __future__ import annotations

from typing import Any

from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.problem import Problem


def search_levels(problem: Problem) -> dict[str, Any]:
    """Returns the levels at the samples of an edge, and those that are proved along a path."""
    return {
        "samples": problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
        "edges": problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
    }
