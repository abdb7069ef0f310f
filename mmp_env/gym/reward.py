"""Reward of a step: progress, success, and a penalty for contact."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float

from mmp_env.sim.execution import REACHED_RAD

PROGRESS_WEIGHT = 10.0
"""Reward per radian by which the mean distance of the joints to their goals decreases."""
SUCCESS_BONUS = 10.0
CONTACT_PENALTY = 10.0
Distance: TypeAlias = tuple[float, float]
"""Largest and mean distance of the joints to their targets [rad]."""


class GoalProgress:
    """Joint positions `q`, end of the last `reference`, and distance to the `target` of all joints [n] [rad].

    `distance_rad` is the largest distance of a joint to its target [rad].
    """

    def __init__(self, q: Float[np.ndarray, "n"], target: Float[np.ndarray, "n"]) -> None:
        self.q, self.reference, self.target = q, q, target
        self._measure()

    @property
    def is_success(self) -> bool:
        """Whether every joint has reached its goal."""
        return self.distance_rad <= REACHED_RAD

    def aim(self, target: Float[np.ndarray, "n"]) -> None:
        """Takes over another target [n] [rad]."""
        self.target = target
        self._measure()

    def update(
        self, q: Float[np.ndarray, "n"], reference: Float[np.ndarray, "n"], *, distance: Distance, contact: bool
    ) -> float:
        """Takes over the positions after an action, and returns its reward.

        Args:
            q: joint positions [rad].
            reference: end of the reference [rad].
            distance: `measured(q, target)`.
            contact: whether an arm touched anything.
        """
        before = self._mean_distance
        self.q, self.reference = q, reference
        self.distance_rad, self._mean_distance = distance
        progress = before - self._mean_distance
        return PROGRESS_WEIGHT * progress + SUCCESS_BONUS * self.is_success - CONTACT_PENALTY * contact

    def _measure(self) -> None:
        self.distance_rad, self._mean_distance = measured(self.q, self.target)


def measured(q: Float[np.ndarray, "*m n"], target: Float[np.ndarray, "*m n"]) -> tuple[Any, Any]:
    """Returns largest and mean distance [rad] of the joints to their targets: two numbers, or two lists of m."""
    distances = np.abs(target - q)
    return distances.max(axis=-1).tolist(), (distances.sum(axis=-1) / distances.shape[-1]).tolist()
