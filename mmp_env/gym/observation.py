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

    Attributes:
        boxes: name of each quantity -> its bounds.
        size: count of all numbers that `look` reads.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        bounds = self._bounds()
        self.boxes = {name: _box(low, high) for name, (low, high) in bounds.items()}
        self.boxes["goal_positions"] = _box(*joint_limits(simulation.cell))
        self.space = spaces.Dict(dict[str, spaces.Space[Any]](self.boxes))
        # One clipped vector for all quantities: calls on many small arrays would cost more than their content.
        self._low, self._high = (np.concatenate([pair[k].ravel() for pair in bounds.values()]) for k in (0, 1))
        self.size = len(self._low)
        ends = np.cumsum([low.size for low, _ in bounds.values()]).tolist()
        self._parts = {
            name: slice(end - low.size, end) for end, (name, (low, _)) in zip(ends, bounds.items(), strict=True)
        }
        self._core = simulation.cell.collision.core
        self._q = np.empty(simulation.count)
        self._rows = [self._q[None, part] for part in simulation.slices.values()]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._simulation,)

    def _bounds(self) -> dict[str, tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]]:
        """Returns name -> lower and upper bounds of all that `look` reads, in this order."""
        cell = self._simulation.cell
        lower, upper = joint_limits(cell)
        fastest = OVERSPEED * np.concatenate([arm.robot.velocity for arm in cell.arms])
        bases = np.array([arm.position for arm in cell.arms])
        spans = np.array([[_span(arm)] for arm in cell.arms])
        return {
            "joint_positions": (lower - OVERSHOOT_RAD, upper + OVERSHOOT_RAD),
            "joint_velocities": (-fastest, fastest),
            "tool_positions": (bases - spans, bases + spans),
            "clearance": (np.array([-MAX_CLEARANCE_M]), np.array([MAX_CLEARANCE_M])),
        }

    def look(self, out: Float[np.ndarray, "size"]) -> None:
        """Reads all but the goals from the simulation into `out`."""
        simulation, parts = self._simulation, self._parts
        self._q[:] = out[parts["joint_positions"]] = simulation.positions
        out[parts["joint_velocities"]] = simulation.velocities
        out[parts["tool_positions"]] = simulation.tool_points.ravel()
        out[parts["clearance"]] = core.cell_clearance(self._core, self._rows)

    def positions(self, seen: Float[np.ndarray, "*m size"]) -> Float[np.ndarray, "*m n"]:
        """Returns the joint positions [rad] in what `look` has read, as a view."""
        return seen[..., self._parts["joint_positions"]]

    def observation(
        self, seen: Float[np.ndarray, "*m size"], goal: Float[np.ndarray, "*m n"]
    ) -> dict[str, Float[np.ndarray, "*m ..."]]:
        """Returns the observation of what `look` has read, or of several such rows as one batch."""
        seen = np.minimum(np.maximum(seen, self._low), self._high)
        out = {name: seen[..., part] for name, part in self._parts.items()}
        out["tool_positions"] = out["tool_positions"].reshape(*seen.shape[:-1], -1, 3)
        out["goal_positions"] = goal.copy()
        return out

    def observe(self, goal: Float[np.ndarray, "n"]) -> dict[str, Float[np.ndarray, "..."]]:
        """Returns the observation of the simulation with these goals [rad]."""
        seen = np.empty(self.size)
        self.look(seen)
        return self.observation(seen, goal)


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
