"""Numbers of the portfolio planner that are not options."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class PortfolioSettings:
    """Settings of `auto`: the turns of its members, and the rounds that improve the first plan."""

    work_before_tree: float = 1_000_000
    """Work of the search for groups before the first tree of APF-ECBS begins, which is slow and finds the rest."""
    tree_share: float = 0.06
    """Share of the trees in the work, relative to the search for groups."""
    grid_coarsening: int = 2
    """Steps of the time grid per step of the improvement grid: half the work, and the final cost is the same."""
    long_plan: float = 1.6
    """Minimum cost of a long first plan, relative to the straight lines: LNS is faster than shortcuts there."""
    long_plan_coarsening: int = 3
    """Steps of the time grid per step of the coarse grid, on which a long plan gets its first LNS and shortcuts."""
    repeat_gain: float = 3e-3
    """Minimum relative saving of the shortcut attempts before the same number of attempts is made again."""
    independent_attempts: int = 150
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
