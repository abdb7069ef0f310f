"""Control modes: the meaning of an action in [-1, 1] for one control period.

Every mode returns a straight reference for the servos, within the velocity bound and the joint limits. The servos
follow the reference with velocity feed-forward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import as_numbers, refused
from mmp_env.errors import MmpError, UnknownNameError

Vector: TypeAlias = Float[np.ndarray, "... n"]
"""Type of an array with one number per joint, arm after arm; or of such rows of several environments."""
CONTROL_RATE_HZ = 10
"""Actions per second of simulated time: one per 0.1 s step of the planners, or 50 physics steps."""
MAX_LEAD_RAD = 0.1
"""Largest lead of the reference over a joint. It keeps a blocked arm from leaping once it is free."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlMode:
    """A control mode for the joints of a cell.

    Args:
        name: one of `CONTROL_MODES`.
        lower: lower joint limits [n] [rad].
        upper: upper joint limits [n] [rad].
        reach: largest motion of each joint in one control period [n] [rad].

    Raises:
        UnknownNameError: for an unknown name.
    """

    name: str
    lower: Vector
    upper: Vector
    reach: Vector

    def __post_init__(self) -> None:
        if self.name not in CONTROL_MODES:
            raise UnknownNameError("control_mode", self.name, CONTROL_MODES)

    def reference(self, action: Vector, q: Vector, before: Vector) -> tuple[Vector, Vector]:
        """Returns begin and end [n] [rad] of the reference of one control period.

        Args:
            action: [n] numbers in [-1, 1].
            q: joint positions now [rad].
            before: end of the reference of the period before [rad].
        """
        begin, end = CONTROL_MODES[self.name](self, action, q, before)
        return begin, _clipped(end, self.lower, self.upper)

    def action(self, end: Vector, q: Vector, before: Vector) -> Vector:
        """Returns the action [n] in [-1, 1] whose reference ends at `end` [n] [rad], or as near as possible.

        The other arguments are those of `reference`.
        """
        if self.name == "position":
            wanted = 2 * (end - self.lower) / (self.upper - self.lower) - 1
        else:
            wanted = (end - (q if self.name == "delta" else before)) / self.reach
        return _clipped(wanted, np.full_like(wanted, -1.0), np.ones_like(wanted))


def _position(mode: ControlMode, action: Vector, q: Vector, before: Vector) -> tuple[Vector, Vector]:
    """Reads the action as a configuration from the lower (-1) to the upper limit (1), approached at full velocity."""
    wanted = mode.lower + (action + 1) / 2 * (mode.upper - mode.lower)
    return before, _within_lead(before + _clipped(wanted - before, -mode.reach, mode.reach), q)


def _velocity(mode: ControlMode, action: Vector, q: Vector, before: Vector) -> tuple[Vector, Vector]:
    """Reads the action as a velocity relative to the largest. The reference continues from its last end."""
    return before, _within_lead(before + action * mode.reach, q)


def _delta(mode: ControlMode, action: Vector, q: Vector, before: Vector) -> tuple[Vector, Vector]:
    """Reads the action as a displacement from the present positions, relative to the largest in one control period."""
    return q, q + action * mode.reach


def _within_lead(reference: Vector, q: Vector) -> Vector:
    return _clipped(reference, q - MAX_LEAD_RAD, q + MAX_LEAD_RAD)


def _clipped(values: Vector, lower: Vector, upper: Vector) -> Vector:
    """Returns what `np.clip` returns, in less time for small arrays."""
    return np.minimum(np.maximum(values, lower), upper)


CONTROL_MODES = {"position": _position, "velocity": _velocity, "delta": _delta}
"""Control modes by name: functions that return begin and end of the reference."""


def checked_action(action: np.ndarray, count: int) -> Float[np.ndarray, "n"]:
    """Returns the action, clipped to [-1, 1]. Raises `MmpError` unless it has `count` finite numbers."""
    values = as_numbers(action)
    if values is None:
        raise refused("the action", action, f"{count} numbers from -1 to 1")
    if values.shape != (count,):
        raise MmpError(f"the action has shape {list(values.shape)}; expected [{count}]")
    if not all(map(math.isfinite, values.tolist())):  # for one action faster than np.isfinite
        raise MmpError(f"the action holds {values[~np.isfinite(values)][0]}; it must be finite numbers")
    return np.minimum(np.maximum(values, -1.0), 1.0)


def checked_actions(actions: np.ndarray, count: int) -> Float[np.ndarray, "m n"]:
    """Returns several actions, each checked like one."""
    values = as_numbers(actions)
    if values is None or values.ndim != 2 or values.shape[1] != count or not np.isfinite(values).all():
        return np.array([checked_action(action, count) for action in actions])
    return np.minimum(np.maximum(values, -1.0), 1.0)


def steps_per_action(control_rate_hz: int, timestep_s: float) -> int:
    """Returns the number of physics steps in one control period. Raises `MmpError` if it is not whole."""
    steps = 1 / (control_rate_hz * timestep_s) if control_rate_hz > 0 else 0.0
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-9 * steps:
        fastest = round(1 / timestep_s)
        raise MmpError(f"control_rate_hz is {control_rate_hz}; it must divide {fastest}, the physics steps per second")
    return round(steps)
