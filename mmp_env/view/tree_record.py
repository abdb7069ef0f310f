"""The conflict tree of a search, recorded from the events of its planner."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mmp_env.brief import brief
from mmp_env.events import ConflictChosen, Event, FastTracked, NodeCreated, NodeExpanded, SearchStarted, SolutionFound
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.wording import counted

_SAME_RAD = 1e-6


@dataclass(kw_only=True, eq=False)
class TreeNode:
    """A node as its planner told of it. What it did not tell is None, nan for the numbers in radians.

    `id` is the place in `TreeRecord.nodes`; `number` is the planner's own, which may come again after a restart.
    `expanded` counts the expansions from 1. `conflict` says in words what the node was branched on, `fast_tracks` has
    the arms that the fast track was tried with and whether that solved it. `paths` are kept where that was asked for.
    """

    id: int
    number: int
    parent: int | None = None
    restart: int = 0
    arm: str | None = None
    constraint: str | None = None
    cost_rad: float = math.nan
    lower_bound_rad: float = math.nan
    conflicts: int | None = None
    conflicting_pairs: int | None = None
    fast_track: bool = False
    created_s: float | None = None
    expanded: int | None = None
    conflict: str | None = None
    fast_tracks: list[tuple[str, bool]] = field(default_factory=list)
    on_solution_path: bool = False
    paths: Mapping[str, np.ndarray] | None = None

    @brief
    def __repr__(self) -> str:
        parent = "a root" if self.parent is None else f"child of {self.parent}"
        apart = f", {self.constraint}" if self.constraint else ""
        conflicts = "" if self.conflicts is None else f", {counted(self.conflicts, 'conflict')}"
        return f"{self.id}: {parent}{apart}{conflicts}, {self.cost_rad:.2f} rad"


class TreeRecord:
    """A watcher that records the conflict tree, all trees of it where the search starts anew.

    `nodes` stand in the order in which they came, parents before their children; `expansions` are ids in their order.
    `solution` is the cheapest node that was told of as one, and the nodes from its root down to it are on the solution
    path. Planners that have no tree tell of their plan alone: one node.
    """

    def __init__(self, problem: Problem | None = None, *, title: str = "", keep_paths: bool = False) -> None:
        self.problem = problem
        self.title = title or (problem.name if problem else "")
        self.keep_paths = keep_paths
        self.nodes: list[TreeNode] = []
        self.expansions: list[int] = []
        self.solution: TreeNode | None = None
        self.clearance_m: float | None = None
        self._newest: dict[int, TreeNode] = {}
        self._restart = 0

    @brief
    def __repr__(self) -> str:
        found = "no solution" if self.solution is None else f"a solution of {self.solution.cost_rad:.2f} rad"
        of = f"of {self.title}: " if self.title else ""
        return f"{of}{counted(len(self.nodes), 'node')}, {len(self.expansions)} expanded, {found}"

    def __call__(self, event: Event) -> None:
        match event:
            case SearchStarted():
                self._restart = event.restart
            case NodeCreated():
                self._create(event)
            case NodeExpanded():
                node = self._of(event.node)
                node.conflicts = event.conflicts if node.conflicts is None else node.conflicts
                self.expansions.append(node.id)
                node.expanded = node.expanded or len(self.expansions)
            case ConflictChosen():
                when = f"{event.start_s:.1f}" if event.start_s == event.end_s else _between(event.start_s, event.end_s)
                self._of(event.node).conflict = f"{event.arm_a} and {event.arm_b} meet at {when} s"
            case FastTracked():
                self._of(event.node).fast_tracks.append((event.arm, event.solved))
            case SolutionFound():
                self._solve(self._of(event.node), event)

    @property
    def parents(self) -> list[int | None]:
        """The parent's id of each node."""
        return [node.parent for node in self.nodes]

    @property
    def roots(self) -> list[TreeNode]:
        """The nodes without a parent: one for each time that the search was started and found its first paths."""
        return [node for node in self.nodes if node.parent is None]

    @property
    def solution_path(self) -> list[TreeNode]:
        """The nodes from a root down to the solution; none without a solution."""
        return self._upwards(self.solution)[::-1]

    def add_plan(self, plan: Plan) -> None:
        """The plan as a node of its own where the planner told of none that is as cheap: one that it made shorter is a
        child of the solution, that of a planner that tells nothing is a root.
        """
        if self.solution is not None and self.solution.cost_rad <= plan.cost_rad + _SAME_RAD:
            return
        node = self._add(
            1 + max((node.number for node in self.nodes), default=-1),
            parent=self.solution.id if self.solution else None,
            cost_rad=plan.cost_rad,
            lower_bound_rad=plan.problem.cost_lower_bound_rad,
            conflicts=0,
            conflicting_pairs=0,
        )
        self._show_way_to(node)

    def _create(self, event: NodeCreated) -> None:
        parent = None if event.parent is None else self._newest.get(event.parent)
        self._add(
            event.node,
            parent=parent.id if parent else None,
            arm=event.arm,
            constraint=event.constraint,
            cost_rad=event.cost_rad,
            lower_bound_rad=event.lower_bound_rad,
            conflicts=event.conflicts,
            conflicting_pairs=event.conflicting_pairs,
            fast_track=event.fast_track,
            created_s=event.elapsed_s,
            paths=dict(event.paths) if self.keep_paths else None,
        )

    def _add(self, number: int, **told: Any) -> TreeNode:
        node = TreeNode(id=len(self.nodes), number=number, restart=self._restart, **told)
        self.nodes.append(node)
        self._newest[number] = node
        return node

    def _of(self, number: int) -> TreeNode:
        """The newest node of that number; a planner may speak of one whose making it has not told."""
        return self._newest.get(number) or self._add(number)

    def _solve(self, node: TreeNode, event: SolutionFound) -> None:
        if math.isnan(node.cost_rad):
            node.cost_rad = event.cost_rad
        if node.conflicts is None:
            node.conflicts = 0
        if self.solution is not None and self.solution.cost_rad < node.cost_rad:
            return
        self.clearance_m = event.clearance_m
        self._show_way_to(node)

    def _show_way_to(self, node: TreeNode) -> None:
        for other in self._upwards(self.solution):
            other.on_solution_path = False
        self.solution = node
        for other in self._upwards(node):
            other.on_solution_path = True

    def _upwards(self, node: TreeNode | None) -> list[TreeNode]:
        out: list[TreeNode] = []
        while node is not None:
            out.append(node)
            node = None if node.parent is None else self.nodes[node.parent]
        return out


def _between(start_s: float, end_s: float) -> str:
    return f"{start_s:.1f} to {end_s:.1f}"
