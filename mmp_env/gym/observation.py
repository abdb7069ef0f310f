"""Observation of a cell: joints, goals, tools and clearance, each within stated bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.sim.simulation import Simulation

OVERSHOOT_RAD = 0.1
"""Bound of observed positions beyond the joint limits, which are soft in MuJoCo."""
OVERSPEED = 2.0
"""Bound of observed velocities relative to the limit of the robot, which contacts can exceed."""
MAX_CLEARANCE_M = 1.0
"""Bound of the observed clearance and penetration."""


class Observer:
    """Observes a simulation as a dict of new float64 arrays in `space`.

    `joint_positions`, `goal_positions` [n] [rad] and `joint_velocities` [n] [rad/s], arm after arm; `tool_positions`
    [a, 3] [m] in the world; `clearance` [1] [m], the least between arms, and between arms and obstacles, negative in
    collision.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        cell, n = simulation.cell, simulation.count
        lower, upper = joint_limits(cell)
        fastest = OVERSPEED * np.concatenate([arm.robot.velocity for arm in cell.arms])
        bases = np.array([arm.position for arm in cell.arms])
        spans = np.array([[_span(arm)] for arm in cell.arms])
        bounds = {
            "joint_positions": (lower - OVERSHOOT_RAD, upper + OVERSHOOT_RAD),
            "joint_velocities": (-fastest, fastest),
            "tool_positions": (bases - spans, bases + spans),
            "clearance": (np.array([-MAX_CLEARANCE_M]), np.array([MAX_CLEARANCE_M])),
        }
        self.boxes = {name: _box(low, high) for name, (low, high) in bounds.items()}
        self.boxes["goal_positions"] = _box(lower, upper)
        self.space = spaces.Dict(dict[str, spaces.Space[Any]](self.boxes))
        # One clipped vector for all quantities: calls on many small arrays would cost more than their content.
        self._low, self._high = (np.concatenate([pair[k].ravel() for pair in bounds.values()]) for k in (0, 1))
        self._joints, self._speeds, self._tools = slice(n), slice(n, 2 * n), slice(2 * n, -1)
        self._core = cell.collision.core
        self._q = np.empty(n)
        self._rows = [self._q[None, part] for part in simulation.slices.values()]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._simulation,)

    def observe(self, q: Float[np.ndarray, "n"], goal: Float[np.ndarray, "n"]) -> dict[str, Float[np.ndarray, "..."]]:
        """Returns the observation. `q` [rad] is the present configuration of the simulation."""
        simulation = self._simulation
        self._q[:] = q
        out = np.concatenate(
            (
                q,
                simulation.velocities,
                simulation.tool_points.ravel(),
                core.cell_clearance(self._core, self._rows),
            )
        )
        np.maximum(out, self._low, out=out)
        np.minimum(out, self._high, out=out)
        return {
            "joint_positions": out[self._joints],
            "joint_velocities": out[self._speeds],
            "goal_positions": goal.copy(),
            "tool_positions": out[self._tools].reshape(-1, 3),
            "clearance": out[-1:],
        }


def _box(low: Float[np.ndarray, "..."], high: Float[np.ndarray, "..."]) -> spaces.Box:
    return spaces.Box(low, high, dtype=np.float64)


def _span(arm: Arm) -> float:
    """Returns an upper bound of the distance from base frame to tool point [m]: the length of all links in one line."""
    lengths = [float(np.linalg.norm(pose[:3, 3])) for pose in [*arm.robot.origins, arm.robot.flange]]
    if arm.tool is not None:
        lengths += [float(np.linalg.norm(arm.tool.mount[:3, 3])), float(np.linalg.norm(arm.tool.point))]
    return sum(lengths)


def joint_limits(cell: Cell) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Returns lower and upper limits [n] [rad] of all joints, arm after arm."""
    return (
        np.concatenate([arm.robot.lower for arm in cell.arms]),
        np.concatenate([arm.robot.upper for arm in cell.arms]),
    )
