"""What a picture or film of a plan must show: the arms wherever they get to, and the things beside them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.sim.scene_appearance import corners, is_ground

_MOST_MOMENTS = 60
_BESIDE_M = 0.15
"""Of an obstacle that goes on beyond the arms, this much is shown around them."""


def plan_outline(plan: Plan) -> Float[np.ndarray, "p 3"]:
    """Points around the arms along the plan and around the obstacles near them [m].

    What the arms stand on is shown only as far as the arms and the obstacles need it.
    """
    cell, start = plan.problem.cell, plan.problem.start
    positions = plan.sampled(np.linspace(0.0, plan.makespan_s, _MOST_MOMENTS))
    arms = np.concatenate([_around(cell, name, positions.get(name, start[name][None])) for name in cell.arm_names])
    low, high = arms.min(axis=0) - _BESIDE_M, arms.max(axis=0) + _BESIDE_M
    things = [corners(obstacle) for obstacle in cell.obstacles if not is_ground(cell, obstacle)]
    near = [part for part in things if (part.max(axis=0) >= low).all() and (part.min(axis=0) <= high).all()]
    return np.concatenate([arms, *(np.clip(part, low, high) for part in near)])


def _around(cell: Cell, arm: str, q: Float[np.ndarray, "k dof"]) -> Float[np.ndarray, "p 3"]:
    """The six outermost points of every sphere of an arm at the configurations `q` [rad]."""
    centers, radii = cell.collision.spheres(arm, np.ascontiguousarray(q))
    offsets = radii[:, None, None] * np.concatenate([np.eye(3), -np.eye(3)])
    return (centers[:, :, None] + offsets).reshape(-1, 3)
