"""Refines many configurations at once by the Levenberg-Marquardt method, until their tools are at target poses."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.chain import Frames
from mmp_env.ik.tool_task import ToolTask

_TOLERANCE = 1e-10
"""Largest error [rad, or arm lengths] of a refined configuration."""
_LONGEST_STEP = 1.0
"""Longest motion of a joint in one step [rad or m]."""
_DAMPING = 1e-2
"""Damping relative to the squared error. It vanishes with the error, so that convergence is quadratic."""
_PATIENCE, _PROGRESS = 5, 0.9
"""Steps before a configuration is given up whose error does not shrink by this factor a step."""


def refined(
    task: ToolTask,
    q: Float[np.ndarray, "n dof"],
    poses: Float[np.ndarray, "n 4 4"],
    *,
    steps: int,
    farthest: float = np.inf,
) -> tuple[Float[np.ndarray, "m dof"], Int[np.ndarray, "m"]]:
    """Returns the refined configurations [rad or m] of those that converge, and their indices.

    Args:
        task: the arm, and what of the pose counts.
        q: configurations to begin with [rad or m].
        poses: target pose of the tool frame in the base frame for each of them.
        steps: largest number of steps.
        farthest: largest error [rad, or arm lengths] of a configuration to begin with.
    """
    active, q = np.arange(len(q)), np.array(q)
    done, best = np.zeros(len(q), dtype=bool), np.full(len(q), np.inf)
    for step in range(steps + 1):
        frames = task.chain.frames(q[active])
        error = task.error(frames, poses[active])
        size = np.sqrt((error**2).sum(axis=1))
        done[active[size < _TOLERANCE]] = True
        hopeless = size > (farthest if step == 0 else np.inf)
        if step > _PATIENCE:
            hopeless |= (size > _PROGRESS * best[active]) & (size > 1e-6)
        best[active] = np.minimum(best[active], size)
        going = (size >= _TOLERANCE) & ~hopeless
        if step == steps or not going.any():
            break
        active = active[going]
        q[active] += _step(task, Frames(*(part[going] for part in frames)), error[going])
    return q[done], np.flatnonzero(done)


def _step(task: ToolTask, frames: Frames, error: Float[np.ndarray, "n rows"]) -> Float[np.ndarray, "n dof"]:
    slope = task.slope(frames)
    transposed = slope.transpose(0, 2, 1)
    damping = _DAMPING * np.minimum((error**2).sum(axis=1), 1.0) + 1e-14
    normal = transposed @ slope + damping[:, None, None] * np.eye(task.chain.dof)
    step = np.linalg.solve(normal, transposed @ error[:, :, None])[:, :, 0]
    longest = np.abs(step).max(axis=1, keepdims=True)
    return step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-12))
