"""Control modes: what an action in [-1, 1] asks of the arms during one control period.

Every mode gives a straight reference for the servos, never faster than the largest velocity and never beyond the joint
limits; the servos follow it with velocity feed-forward.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.errors import UnknownNameError

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
