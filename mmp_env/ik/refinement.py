"""Refines many configurations at once by the Levenberg-Marquardt method, until their tools are at target poses."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.ik.chain import Frames, SerialChain, jacobian, rotation_vector

TOLERANCE = 1e-10
"""Largest error [rad, or arm lengths] of a refined configuration."""
_LONGEST_STEP = 1.0
"""Longest motion of a joint in one step [rad or m]."""
_DAMPING = 1e-2
"""Damping relative to the squared error. It vanishes with the error, so that convergence is quadratic."""


def refined(
    chain: SerialChain, q: Float[np.ndarray, "n dof"], poses: Float[np.ndarray, "n 4 4"], *, steps: int
) -> tuple[Float[np.ndarray, "m dof"], Int[np.ndarray, "m"]]:
    """Returns the refined configurations [rad or m] of those that converge, and their indices.

    Args:
        chain: the arm.
        q: configurations to begin with [rad or m].
        poses: target pose of the tool frame in the base frame for each of them.
        steps: largest number of steps.
    """
    active, q = np.arange(len(q)), np.array(q)
    done, best = np.zeros(len(q), dtype=bool), np.full(len(q), np.inf)
    for step in range(steps + 1):
        frames = chain.frames(q[active])
        error = pose_error(chain, frames, poses[active])
        size = np.linalg.norm(error, axis=1)
        converged = size < TOLERANCE
        done[active[converged]] = True
        # A start that has not come closer within some steps will not; it would cost the time of those that will.
        hopeless = (size > 0.9 * best[active]) & (step > 5) & (size > 1e-6)
        best[active] = np.minimum(best[active], size)
        keep = ~converged & ~hopeless
        if step == steps or not keep.any():
            break
        active = active[keep]
        q[active] += _step(chain, Frames(*(part[keep] for part in frames)), error[keep])
    return q[done], np.flatnonzero(done)


def pose_error(chain: SerialChain, frames: Frames, poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 6"]:
    """Returns the position error [arm lengths] and the rotation [rad] from tool frames to poses."""
    position = (poses[:, :3, 3] - frames.position) / chain.length
    rotation = rotation_vector(poses[:, :3, :3] @ frames.rotation.transpose(0, 2, 1))
    return np.concatenate([position, rotation], axis=1)


def _step(chain: SerialChain, frames: Frames, error: Float[np.ndarray, "n 6"]) -> Float[np.ndarray, "n dof"]:
    slope = jacobian(chain, frames)
    slope[:, :3] /= chain.length
    transposed = slope.transpose(0, 2, 1)
    damping = _DAMPING * np.minimum((error**2).sum(axis=1), 1.0) + 1e-14
    normal = transposed @ slope + damping[:, None, None] * np.eye(chain.dof)
    step = np.linalg.solve(normal, transposed @ error[:, :, None])[:, :, 0]
    longest = np.abs(step).max(axis=1, keepdims=True)
    return step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-12))
