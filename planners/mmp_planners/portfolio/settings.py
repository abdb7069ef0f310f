"""Numbers of the portfolio planner that are not options."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class PortfolioSettings:
    """Settings of `auto`: the turns of its members, and the rounds that improve the first plan."""

    composite_turn: int = 2000
    """Work of the composite search in one turn: iterations times arms."""
    work_before_repair: float = 16_000
    """Work of the composite search before local repair begins."""
    work_before_tree: float = 200_000
    """Work of the composite search before the first tree of APF-ECBS begins, which is slow and finds the rest."""
    repair_share: float = 1.5
    """Share of local repair in the work. In crowded rings a unit of its work takes less time than one of the others."""
    tree_share: float = 0.25
    """Share of the trees, likewise."""
    usual_growth: float = 0.012
    """Share of iterations that add a node to a tree of the composite search, with which its share in the work is 1."""
    least_share: float = 0.02
    """Least share of the composite search in the work."""
    most_share: float = 3.0
    """Largest share of the composite search in the work."""
    most_composite: int = 8
    """Number of arms above which the composite search gets less of the work."""
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

    def composite_share(self, growth: float, arms: int) -> float:
        """Returns the share of the composite search in the work, by the growth of its trees.

        The trees of many arms may grow, but hardly ever meet.
        """
        many = max(arms / self.most_composite, 1.0) ** 2
        return min(max((growth / self.usual_growth) ** 2, self.least_share), self.most_share) / many
