"""Problems and paths in the composite space, all joints of all arms, and the levels of searches in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.problem import Problem


def all_joints(problem: Problem, q: Mapping[str, Float[np.ndarray, "_dof"]]) -> Float[np.ndarray, "all_dof"]:
    """Returns the joints of all arms [rad, of slides m], in the order of the cell."""
    return np.concatenate([q[name] for name in problem.cell.arm_names])


def search_levels(problem: Problem) -> dict[str, Any]:
    """Returns the levels at the samples of an edge, and those that are proved along a path."""
    return {
        "samples": problem.levels(SEARCH_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR),
        "edges": problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
    }
