"""Joint limits and whole turns of hinges: all configurations within the limits that are the same but for turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env import core

_TURN = 2 * np.pi
_DIGITS = 9
"""Decimal places of configurations. The last bits of a floating-point result are not the same on every machine."""
_SLACK = 1e-9
"""Distance [rad or m] outside of a limit at which a configuration is moved onto the limit."""
_NEIGHBOURS = 16
"""Number of neighbours among which equal configurations are sought."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JointBox:
    """Joint limits [rad or m]. Hinges may turn; slides do not."""

    lower: Float[np.ndarray, "dof"]
    upper: Float[np.ndarray, "dof"]
    hinges: Bool[np.ndarray, "dof"]

    def one_turn(self) -> tuple[Float[np.ndarray, "dof"], Float[np.ndarray, "dof"]]:
        """Returns the corners of the box, its hinges reduced to the turn about the middle."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        half = np.where(self.hinges, np.minimum(half, np.pi), half)
        return middle - half, middle + half

    def inside(self, q: Float[np.ndarray, "n dof"], slack: float = _SLACK) -> Bool[np.ndarray, "n"]:
        """Returns whether some turns bring configurations into the box, `slack` [rad or m] around it included."""
        turned = self._turned(q, slack)
        return np.asarray(((turned >= self.lower - slack) & (turned <= self.upper + slack)).all(axis=1))

    def within(self, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "m dof"]:
        """Returns the configurations that some turns bring into the box, with the least turns that do."""
        out = np.round(self._turned(q[self.inside(q)], _SLACK), _DIGITS)
        return np.clip(out, self.lower, self.upper)

    def with_turns(
        self, q: Float[np.ndarray, "n dof"], near: Float[np.ndarray, "dof"], limit: int
    ) -> tuple[Float[np.ndarray, "m dof"], Int[np.ndarray, "m"]]:
        """Returns configurations with all their turns, the nearest to `near` first, and the index in `q` of each.

        Distance is the sum over the joints. Equally near ones have the order of their joints.

        Args:
            q: configurations from `within`.
            near: a configuration [rad or m].
            limit: largest number of configurations; the nearest remain.
        """
        out, owners = core.with_turns(q, self.lower, self.upper, self.hinges, near, limit)
        return out, owners[:, 0]

    def nearest_turns(
        self, q: Float[np.ndarray, "n dof"], near: Float[np.ndarray, "dof"]
    ) -> Float[np.ndarray, "n dof"]:
        """Returns configurations from `within` with the turns within the limits that bring them nearest to `near`."""
        most = np.where(self.hinges, np.floor((self.upper + _SLACK - q) / _TURN), 0.0)
        turns = np.clip(np.round((near - q) / _TURN), 0.0, np.maximum(most, 0.0))
        return np.clip(np.round(q + turns * _TURN, _DIGITS), self.lower, self.upper)

    def least_beyond(self, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n dof"]:
        """Returns configurations with the turns that bring their hinges nearest to the middle of the limits."""
        middle = (self.lower + self.upper) / 2
        return q + np.where(self.hinges, np.round((middle - q) / _TURN), 0.0) * _TURN

    def unlimited(self) -> JointBox:
        """Returns the box with a full turn of each hinge."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        half = np.where(self.hinges, np.pi, half)
        return JointBox(lower=middle - half, upper=middle + half, hinges=self.hinges)

    def _turned(self, q: Float[np.ndarray, "n dof"], slack: float) -> Float[np.ndarray, "n dof"]:
        return q + np.where(self.hinges, np.ceil((self.lower - slack - q) / _TURN), 0.0) * _TURN


def distinct(q: Float[np.ndarray, "n dof"], tolerance: float) -> Float[np.ndarray, "m dof"]:
    """Returns configurations without those that differ from another by at most `tolerance` in every joint.

    Equal configurations are found among neighbours in the order of a projection that keeps others apart.
    """
    weights = np.sqrt(np.arange(2.0, q.shape[1] + 2))
    along = q @ weights
    order = np.argsort(along, kind="stable")
    q, along = q[order], along[order]
    repeated = np.zeros(len(q), dtype=bool)
    for shift in range(1, min(_NEIGHBOURS, len(q) - 1) + 1):
        if (along[shift:] - along[:-shift]).min() > tolerance * weights.sum():
            break
        same = np.abs(q[shift:] - q[:-shift]).max(axis=1) <= tolerance
        repeated[shift:] |= same & ~repeated[:-shift]
    return q[~repeated]
