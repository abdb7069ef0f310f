"""Joint limits and whole turns of hinges: all configurations within the limits that are the same but for turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

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

    def widened(self, slack: float) -> JointBox:
        """Returns the box with `slack` [rad or m] around it."""
        return JointBox(lower=self.lower - slack, upper=self.upper + slack, hinges=self.hinges)

    def unlimited(self) -> JointBox:
        """Returns the box with a full turn of each hinge, and half as much again of each slide."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        half = np.where(self.hinges, np.pi, 1.5 * half)
        return JointBox(lower=middle - half, upper=middle + half, hinges=self.hinges)

    def turned(self, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "n dof"]:
        """Returns the configurations with the least turns above the lower limits."""
        return self._turned(q, _SLACK)

    def within(self, q: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "m dof"]:
        """Returns the configurations that some turns bring into the box, with the least turns that do."""
        out = np.round(self._turned(q[self.inside(q)], _SLACK), _DIGITS)
        return np.clip(out, self.lower, self.upper)

    def with_turns(
        self, q: Float[np.ndarray, "n dof"], near: Float[np.ndarray, "dof"], limit: int
    ) -> Float[np.ndarray, "m dof"]:
        """Returns configurations with all their turns, the nearest to `near` by the sum of all joints first.

        Args:
            q: configurations from `within`.
            near: a configuration [rad or m].
            limit: largest number of configurations; the nearest remain.
        """
        values, costs = self._choices(q, near)
        best = costs.min(axis=2)
        # The least cost of the joints that follow: a bound that some completion reaches, so the cut loses nothing.
        rest = best.sum(axis=1)
        owner, partial, cost = np.arange(len(q)), np.empty((len(q), 0)), np.zeros(len(q))
        for k in range(q.shape[1]):
            rest = rest - best[:, k]
            total = cost[:, None] + costs[owner, k]
            row, choice = np.nonzero(np.isfinite(total))
            partial = np.column_stack([partial[row], values[owner[row], k, choice]])
            owner, cost = owner[row], total[row, choice]
            order = _ordered(np.column_stack([partial, q[owner, k + 1 :]]), cost + rest[owner])[:limit]
            partial, owner, cost = partial[order], owner[order], cost[order]
        return partial

    def _turned(self, q: Float[np.ndarray, "n dof"], slack: float) -> Float[np.ndarray, "n dof"]:
        return q + np.where(self.hinges, np.ceil((self.lower - slack - q) / _TURN), 0.0) * _TURN

    def _choices(
        self, q: Float[np.ndarray, "n dof"], near: Float[np.ndarray, "dof"]
    ) -> tuple[Float[np.ndarray, "n dof turns"], Float[np.ndarray, "n dof turns"]]:
        """Returns the positions of each joint, and their distances from `near`: infinite outside of the limits."""
        count = np.where(self.hinges, np.floor((self.upper - self.lower) / _TURN + 1e-6), 0.0)
        turns = np.arange(int(count.max(initial=0.0)) + 1)
        values = np.round(q[:, :, None] + turns * _TURN, _DIGITS)
        outside = (turns > 0) & (~self.hinges[:, None] | (values > self.upper[:, None] + _SLACK))
        values = np.minimum(values, self.upper[:, None])
        return values, np.where(outside, np.inf, np.abs(values - near[:, None]))


def distinct(q: Float[np.ndarray, "n dof"], tolerance: float) -> Float[np.ndarray, "m dof"]:
    """Returns configurations without those that differ from another by at most `tolerance` in every joint.

    Equal configurations are found among neighbours in the order of a projection that keeps others apart.
    """
    weights = np.sqrt(np.arange(2.0, q.shape[1] + 2))
    q = q[np.argsort(q @ weights, kind="stable")]
    repeated = np.zeros(len(q), dtype=bool)
    for shift in range(1, min(_NEIGHBOURS, len(q) - 1) + 1):
        same = np.abs(q[shift:] - q[:-shift]).max(axis=1) <= tolerance
        repeated[shift:] |= same & ~repeated[:-shift]
    return q[~repeated]


def _ordered(q: Float[np.ndarray, "n dof"], cost: Float[np.ndarray, "n"]) -> Int[np.ndarray, "n"]:
    """Returns the order by cost, equal costs by the joints."""
    return np.lexsort((*q.T[::-1], np.round(cost, 6)))
