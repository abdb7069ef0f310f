"""Self-motions of redundant arms: follows the curves of configurations that all have the tool at its pose."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.ik.refinement import refined
from mmp_env.ik.tool_task import ToolTask
from mmp_env.ik.turns import JointBox, distinct

_ROUNDS = 64
_STEPS = 5
_CROWDED = 0.3
"""Distance [steps] at which a new configuration is left out."""
_AHEAD = 0.5
"""Least cosine of the angle between a curve and the direction to a neighbour on it."""


def densified(
    task: ToolTask,
    box: JointBox,
    q: Float[np.ndarray, "n dof"],
    pose: Float[np.ndarray, "4 4"],
    *,
    step: float,
    most: int,
) -> Float[np.ndarray, "m dof"]:
    """Returns configurations and others on the same curves, so that the curves have no gap within the joint limits.

    Args:
        task: the arm, which has one joint more than the task has equations.
        box: the joint limits.
        q: configurations with the tool at its pose.
        pose: of the tool frame in the base frame.
        step: distance between neighbours on a curve [rad or m], over all joints together.
        most: number of configurations at which the search stops.
    """
    tangents = _tangents(task, q)
    ahead, behind = (~_has_neighbour(q, sign * tangents, q, step) for sign in (1.0, -1.0))
    start, direction = np.concatenate([q[ahead], q[behind]]), np.concatenate([tangents[ahead], -tangents[behind]])
    for _ in range(_ROUNDS):
        if not len(start) or len(q) >= most:
            break
        new, rows = refined(task, start + step * direction, np.broadcast_to(pose, (len(start), 4, 4)), steps=_STEPS)
        moved = new - start[rows]
        near = np.sqrt((moved**2).sum(axis=1)) < 2 * step
        start, direction = box.turned(new[near]), moved[near]
        inside = box.inside(start)
        start, direction = start[inside], direction[inside]
        alone = ~_crowded(start, q, step)
        start, direction = start[alone], direction[alone]
        if not len(start):
            break
        q = np.concatenate([q, distinct(start, _CROWDED * step)])
        tangents = _tangents(task, start)
        direction = tangents * np.where((tangents * direction).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        on = ~_has_neighbour(start, direction, q, step)
        start, direction = start[on], direction[on]
    return q


def _tangents(task: ToolTask, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n dof"]:
    """Returns unit vectors along which the joints move without the tool, by inverse iteration."""
    slope = task.slope(task.chain.frames(q))
    inverse = np.linalg.inv(slope.transpose(0, 2, 1) @ slope + 1e-9 * np.eye(task.chain.dof))
    out = inverse @ np.linspace(1.0, 2.0, task.chain.dof)
    for _ in range(2):
        out = (inverse @ (out / np.linalg.norm(out, axis=1, keepdims=True))[:, :, None])[:, :, 0]
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def _squared_distances(a: Float[np.ndarray, "n dof"], b: Float[np.ndarray, "m dof"]) -> Float[np.ndarray, "n m"]:
    return (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * (a @ b.T)


def _has_neighbour(
    q: Float[np.ndarray, "n dof"],
    direction: Float[np.ndarray, "n dof"],
    others: Float[np.ndarray, "m dof"],
    step: float,
) -> Bool[np.ndarray, "n"]:
    """Returns whether one of the others is at most a step away in about that direction."""
    squared = np.maximum(_squared_distances(q, others), 0.0)
    along = direction @ others.T - (direction * q).sum(axis=1)[:, None]
    near = (squared < (1.01 * step) ** 2) & (along > _AHEAD * np.sqrt(squared)) & (along > 1e-6)
    return np.asarray(near.any(axis=1))


def _crowded(q: Float[np.ndarray, "n dof"], others: Float[np.ndarray, "m dof"], step: float) -> Bool[np.ndarray, "n"]:
    return np.asarray((_squared_distances(q, others) < (_CROWDED * step) ** 2).any(axis=1))
