"""Control modes: what an action in [-1, 1] asks of the arms during one control period.

Every mode gives a straight reference for the servos, never faster than the largest velocity and never beyond the joint
limits; the servos follow it with velocity feed-forward.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import as_numbers, refused
from mmp_env.errors import MmpError, UnknownNameError

CONTROL_RATE_HZ = 10
"""Actions per second of simulated time: one for each 0.1 s step of the planners, 50 physics steps."""
LEASH_RAD = 0.1
"""How far the reference may be ahead of a joint, so that an arm that was held up does not leap when it is free."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlMode(ABC):
    """`lower`, `upper` [n] [rad]: the joint limits; `reach` [n] [rad]: the most that a joint moves in one period."""

    lower: Float[np.ndarray, "n"]
    upper: Float[np.ndarray, "n"]
    reach: Float[np.ndarray, "n"]

    def reference(
        self, action: Float[np.ndarray, "n"], q: Float[np.ndarray, "n"], before: Float[np.ndarray, "n"]
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Begin and end [rad] of the reference, from where the joints are (`q`) and where the last one ended."""
        begin, end = self._ends(action, q, before)
        return begin, np.minimum(np.maximum(end, self.lower), self.upper)

    @abstractmethod
    def _ends(
        self, action: Float[np.ndarray, "n"], q: Float[np.ndarray, "n"], before: Float[np.ndarray, "n"]
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]: ...


class PositionMode(ControlMode):
    """The action names a configuration, -1 the lower limit and 1 the upper; the reference moves there at top speed."""

    def _ends(
        self, action: Float[np.ndarray, "n"], q: Float[np.ndarray, "n"], before: Float[np.ndarray, "n"]
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        wanted = self.lower + (action + 1) / 2 * (self.upper - self.lower)
        return before, _leashed(before + np.minimum(np.maximum(wanted - before, -self.reach), self.reach), q)


class VelocityMode(ControlMode):
    """The action is a velocity, 1 the largest; the reference goes on from where it was."""

    def _ends(
        self, action: Float[np.ndarray, "n"], q: Float[np.ndarray, "n"], before: Float[np.ndarray, "n"]
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        return before, _leashed(before + action * self.reach, q)


class DeltaMode(ControlMode):
    """The action is a change from where the joints are now, 1 the most that one control period allows."""

    def _ends(
        self, action: Float[np.ndarray, "n"], q: Float[np.ndarray, "n"], before: Float[np.ndarray, "n"]
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        return q, q + action * self.reach


def _leashed(reference: Float[np.ndarray, "n"], q: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    return np.minimum(np.maximum(reference, q - LEASH_RAD), q + LEASH_RAD)


CONTROL_MODES: dict[str, type[ControlMode]] = {"position": PositionMode, "velocity": VelocityMode, "delta": DeltaMode}


def find_control_mode(name: str) -> type[ControlMode]:
    """The mode of that name. Raises `UnknownNameError`."""
    if name not in CONTROL_MODES:
        raise UnknownNameError("control_mode", name, CONTROL_MODES)
    return CONTROL_MODES[name]


def checked_action(action: np.ndarray, count: int) -> Float[np.ndarray, "n"]:
    """The action within [-1, 1]. Raises `MmpError` where it has not `count` numbers or not all are finite."""
    values = as_numbers(action)
    if values is None:
        raise refused("the action", action, f"{count} numbers from -1 to 1")
    if values.shape != (count,):
        raise MmpError(f"the action has shape {list(values.shape)}; expected [{count}]")
    # The square is finite only if all numbers are, and takes a fifth of the time of looking at each.
    if not math.isfinite(values @ values) and not np.isfinite(values).all():
        raise MmpError(f"the action holds {values[~np.isfinite(values)][0]}; it must be finite numbers")
    return np.minimum(np.maximum(values, -1.0), 1.0)


def steps_per_action(control_rate_hz: int, timestep_s: float) -> int:
    """Physics steps in one control period. Raises `MmpError` where that is no whole number."""
    steps = 1 / (control_rate_hz * timestep_s) if control_rate_hz > 0 else 0.0
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-9 * steps:
        fastest = round(1 / timestep_s)
        raise MmpError(f"control_rate_hz is {control_rate_hz}; it must divide {fastest}, the physics steps per second")
    return round(steps)
