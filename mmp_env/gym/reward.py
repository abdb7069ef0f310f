"""Reward of a step: progress, success, and a penalty for contact."""

from __future__ import annotations

PROGRESS_WEIGHT = 10.0
"""Reward per radian by which the mean distance of the joints to their goals decreases."""
SUCCESS_BONUS = 10.0
CONTACT_PENALTY = 10.0


def step_reward(progress_rad: float, *, success: bool, contact: bool) -> float:
    """Returns the reward of one control period.

    Args:
        progress_rad: decrease of the mean distance of the joints to their goals [rad].
        success: whether every joint has reached its goal.
        contact: whether an arm touched anything.
    """
    return PROGRESS_WEIGHT * progress_rad + SUCCESS_BONUS * success - CONTACT_PENALTY * contact
