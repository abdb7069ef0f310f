"""Refines many configurations at once by the Levenberg-Marquardt method, until their tools are at target poses."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Int

from mmp_env import core
from mmp_env.ik.tool_task import ToolTask

_ANY_ERROR = 1e6
"""Largest error [rad, or arm lengths] of configurations to begin with where there is no bound."""


def refined(
    task: ToolTask,
    q: Float[np.ndarray, "n dof"],
    poses: Float[np.ndarray, "n 4 4"],
    *,
    steps: int,
    farthest: float = math.inf,
) -> tuple[Float[np.ndarray, "m dof"], Int[np.ndarray, "m"]]:
    """Returns the refined configurations [rad or m] of those that converge, and their indices.

    Args:
        task: the arm, and what of the pose counts.
        q: configurations to begin with [rad or m].
        poses: target pose of the tool frame in the base frame for each of them.
        steps: largest number of steps.
        farthest: largest error [rad, or arm lengths] of a configuration to begin with.
    """
    out, rows = core.refine_tool_pose(
        **task.chain.numbers,
        rows=task.rows,
        q=np.ascontiguousarray(q),
        poses=np.ascontiguousarray(poses),
        steps=steps,
        farthest=min(farthest, _ANY_ERROR),
    )
    return out, rows[:, 0]
