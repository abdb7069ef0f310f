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
    """A node as its planner reported it. Unknown values are None, or nan for numbers in radians.

    Attributes:
        id: index in `TreeRecord.nodes`.
        number: the planner's number, which may occur again after a restart.
        expanded: number of the expansion, from 1.
        conflict: the conflict that the node was branched on, as text.
        fast_tracks: arms that the fast track was tried with, and whether it solved the node.
        paths: the paths, if the record keeps them.
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
    """A watcher that records the conflict tree, or all trees if the search restarts.

    `nodes` are in order of creation, parents before their children; `expansions` are their ids in order of expansion.
    `solution` is the cheapest solution so far; the nodes from its root to it are on the solution path. A planner
    without a tree reports its plan alone: one node.
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
                self._of(event.node).fast_tracks.append((", ".join(event.arms), event.solved))
            case SolutionFound():
                self._solve(self._of(event.node), event)

    @property
    def parents(self) -> list[int | None]:
        """Returns the parent's id of each node."""
        return [node.parent for node in self.nodes]

    @property
    def roots(self) -> list[TreeNode]:
        """Returns the nodes without a parent: one per start of the search that found its first paths."""
        return [node for node in self.nodes if node.parent is None]

    @property
    def solution_path(self) -> list[TreeNode]:
        """Returns the nodes from a root to the solution; none without a solution."""
        return self._upwards(self.solution)[::-1]

    def add_plan(self, plan: Plan) -> None:
        """Adds the plan as a node if no reported node is as cheap.

        A plan that the planner has shortened is a child of the solution; that of a planner without a tree is a root.
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
        self._mark_solution(node)

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

    def _add(self, number: int, **fields: Any) -> TreeNode:
        node = TreeNode(id=len(self.nodes), number=number, restart=self._restart, **fields)
        self.nodes.append(node)
        self._newest[number] = node
        return node

    def _of(self, number: int) -> TreeNode:
        """Returns the newest node of that number, or a new one if the planner has not reported its creation."""
        return self._newest.get(number) or self._add(number)

    def _solve(self, node: TreeNode, event: SolutionFound) -> None:
        if math.isnan(node.cost_rad):
            node.cost_rad = event.cost_rad
        if node.conflicts is None:
            node.conflicts = 0
        if self.solution is not None and self.solution.cost_rad < node.cost_rad:
            return
        self.clearance_m = event.clearance_m
        self._mark_solution(node)

    def _mark_solution(self, node: TreeNode) -> None:
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
