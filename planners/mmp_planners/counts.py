"""Counts of a run, and its best solution."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from mmp_env.model.plan import Plan


@dataclass(kw_only=True)
class RunCounts:
    """Counts of every planner. The same run gives the same counts."""

    restarts: int = 0
    failed_certificates: int = 0
    shortcuts: int = 0

    def stats(self) -> dict[str, Any]:
        """Returns the counts as statistics of a result; None where nothing of the kind took place."""
        return dict(vars(self))


@dataclass(kw_only=True)
class SingleArmCounts(RunCounts):
    """Counts of planners that plan one arm at a time."""

    low_level_calls: int = 0
    root_conflicts: int | None = None


@dataclass(kw_only=True)
class TreeCounts(SingleArmCounts):
    """Counts of a conflict tree. A node is generated when its paths are planned."""

    expanded_nodes: int = 0
    generated_nodes: int = 0
    dropped_children: int = 0
    repulsions: int = 0
    fast_track_tries: int = 0
    fast_track_hits: int = 0

    def next_node(self) -> int:
        """Counts a generated node and returns its number."""
        self.generated_nodes += 1
        return self.generated_nodes - 1


@dataclass(kw_only=True)
class PortfolioCounts(TreeCounts):
    """Counts that the members of a portfolio share, and the member that found the first plan."""

    found_by: str | None = None
    replanned: int = 0
    """Number of LNS attempts that made the plan shorter."""
    recombined: int = 0
    """Number of rounds in which path recombination made the plan shorter."""

    def stats(self) -> dict[str, Any]:
        """Returns the counts; those of a conflict tree are None if no tree was grown."""
        of_tree = {f.name for f in dataclasses.fields(TreeCounts)} - {
            f.name for f in dataclasses.fields(SingleArmCounts)
        }
        grown = self.generated_nodes > 0
        return {key: value if grown or key not in of_tree else None for key, value in super().stats().items()}


@dataclass(frozen=True, kw_only=True, eq=False)
class Incumbent:
    """The best solution so far: its plan, cost [rad], proved clearance [m], and its node if it is from a tree."""

    plan: Plan
    cost: float
    clearance: float
    found_expansion: int = 0
    """Number of nodes that were expanded before it."""
    node: int | None = None
    bound_met: bool | None = None
    """True if the cost is within the planner's bound; None if it has no bound."""
