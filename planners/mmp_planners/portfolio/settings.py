"""Numbers of the portfolio planner that are not options."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class PortfolioSettings:
    """Settings of `auto`: the turns of its members, and the rounds that improve the first plan."""

    first_composite_turn: int = 500
    """Number of iterations of the composite search in its first turn. Each further turn has twice as many."""
    longest_composite_turn: int = 200_000
    """Largest number of iterations of the composite search in one turn."""
    turns_before_tree: int = 2
    """Number of turns of the other members before the first tree of APF-ECBS, which takes as long as many of them."""
    good_ratio: float = 1.01
    """Ratio of cost to straight lines at which a plan is good enough."""
    grid_coarsening: int = 2
    """Steps of the time grid per step of the improvement grid: half the work, and the final cost is the same."""
    repeat_gain: float = 3e-3
    """Minimum relative saving of the shortcut attempts before the same number of attempts is made again."""
    independent_attempts: int = 500
    """Number of attempts to shorten the paths of all arms independently of each other."""
    independent_repeat_gain: float = 5e-4
    """Minimum relative saving of these attempts before the same number of attempts is made again."""
    round_gain: float = 2e-3
    """Minimum relative saving of a round. A round that saves less has failed."""
    failures_before_pause: int = 2
    """Failed rounds in a row before shortening of the best plan pauses; path recombination goes on."""
    failures_before_stop: int = 8
    """Failed rounds in a row before `auto` stops."""
    most_orders: int = 8
    """Largest number of orders of the arms that path recombination tries in one round."""
