"""What a step in a cell is worth to a learner: progress, success, and a penalty for contact."""

from __future__ import annotations

PROGRESS_WEIGHT = 10.0
"""Reward for each radian that the joints come nearer to their goals on average."""
SUCCESS_BONUS = 10.0
CONTACT_PENALTY = 10.0


def step_reward(progress_rad: float, *, success: bool, contact: bool) -> float:
    """The reward of one control period in which the joints came `progress_rad` [rad] nearer on average."""
    return PROGRESS_WEIGHT * progress_rad + SUCCESS_BONUS * success - CONTACT_PENALTY * contact
