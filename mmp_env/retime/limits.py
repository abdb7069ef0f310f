"""Velocity, acceleration and jerk limits of all joints of a cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.cell import Cell
from mmp_env.model.problem import Problem, limits_per_joint
from mmp_env.model.robot import frozen_array

JointLimits = float | Mapping[str, ArrayLike] | None
"""Limits: a number for all joints, or arm name -> a number or [dof]; None for the robots' own."""
LEAST_RAMP_S = 1e-4
"""Shortest time [s] to reach the full velocity or acceleration. Ruckig finds no profile if it is near 0."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RateLimits:
    """Limits of all joints [n], arm after arm as the cell has them: [rad/s], [rad/s^2], [rad/s^3]."""

    velocity: Float[np.ndarray, "n"]
    acceleration: Float[np.ndarray, "n"]
    jerk: Float[np.ndarray, "n"]

    def reduced(self, share: float) -> RateLimits:
        """Returns the limits with a share of acceleration and jerk, bounded by `LEAST_RAMP_S`."""
        acceleration = np.minimum(share * self.acceleration, self.velocity / LEAST_RAMP_S)
        jerk = np.minimum(share * self.jerk, acceleration / LEAST_RAMP_S)
        return RateLimits(velocity=self.velocity, acceleration=acceleration, jerk=jerk)


def rate_limits(problem: Problem, max_acceleration: JointLimits = None, max_jerk: JointLimits = None) -> RateLimits:
    """Returns the problem's velocity limits, and the given or the robots' own acceleration and jerk limits.

    Given limits may exceed the robot's own: a vendor publishes acceleration limits for the Panda alone, the others are
    our defaults (docs/reference/robots.md).

    Args:
        max_acceleration: [rad/s^2].
        max_jerk: [rad/s^3].

    Raises:
        MmpError: for wrong arms or numbers.
    """
    cell = problem.cell
    return RateLimits(
        velocity=np.concatenate([problem.max_velocity[name] for name in cell.arm_names]),
        acceleration=joined(cell, arm_limits(cell, max_acceleration, "acceleration")),
        jerk=joined(cell, arm_limits(cell, max_jerk, "jerk")),
    )


def arm_limits(cell: Cell, given: JointLimits, what: str) -> dict[str, Float[np.ndarray, "_"]]:
    """Returns arm name -> [dof], read-only; `what` is `acceleration` or `jerk`. Raises `MmpError`."""
    if isinstance(given, Mapping):
        for name in given:
            if name not in cell.arm_names:
                raise MmpError(f"max_{what}: {UnknownNameError('arm', name, cell.arm_names)}")
    out = {}
    for arm in cell.arms:
        if isinstance(given, Mapping) and arm.name not in given:
            raise MmpError(f"max_{what} has no entry for arm '{arm.name}'")
        own = getattr(arm.robot, what)
        values = given[arm.name] if isinstance(given, Mapping) else own if given is None else given
        out[arm.name] = frozen_array(limits_per_joint(f"max_{what}", arm, values, own))
    return out


def joined(cell: Cell, by_arm: Mapping[str, Float[np.ndarray, "*t dof"]]) -> Float[np.ndarray, "*t n"]:
    """Returns the joints of all arms side by side, in the order of the cell."""
    return np.concatenate([by_arm[name] for name in cell.arm_names], axis=-1)


def split(cell: Cell, q: Float[np.ndarray, "*t n"]) -> dict[str, Float[np.ndarray, "*t dof"]]:
    """Returns arm name -> an array of its joints."""
    ends = np.cumsum([arm.dof for arm in cell.arms]).tolist()
    return {
        arm.name: np.ascontiguousarray(q[..., end - arm.dof : end]) for arm, end in zip(cell.arms, ends, strict=True)
    }
