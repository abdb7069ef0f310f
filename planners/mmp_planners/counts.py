"""What a run counts, and its best solution."""

from __future__ import annotations

from dataclasses import dataclass

from mmp_env.model.plan import Plan


@dataclass(kw_only=True)
class RunCounts:
    """What every planner counts; the same run gives the same counts."""

    restarts: int = 0
    failed_certificates: int = 0
    shortcuts: int = 0


@dataclass(kw_only=True)
class ArmCounts(RunCounts):
    """What planners count that plan one arm at a time."""

    low_level_calls: int = 0
    root_conflicts: int | None = None


@dataclass(kw_only=True)
class Counts(ArmCounts):
    """What a conflict tree counts. A node is generated when its paths are planned."""

    expanded_nodes: int = 0
    generated_nodes: int = 0
    dropped_children: int = 0
    repulsions: int = 0
    fast_track_tries: int = 0
    fast_track_hits: int = 0

    def next_node(self) -> int:
        """The number of a node that is generated now."""
        self.generated_nodes += 1
        return self.generated_nodes - 1


@dataclass(kw_only=True)
class Incumbent:
    """The best solution so far: its plan and what was proved of it. `node` is that of the tree that it is from."""

    plan: Plan
    cost: float
    clearance: float
    found_at: int = 0
    """Nodes that were expanded before it."""
    node: int | None = None
    bound_met: bool | None = None  # None: the planner knows no bound
