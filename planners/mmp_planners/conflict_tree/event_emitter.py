"""Turns what the search does into events; costs nothing where nobody watches."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from mmp_env import events
from mmp_planners.conflict_tree.constraints import ConflictInterval
from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.repulsion import Modified
from mmp_planners.planning_context import Path, PlanningContext

if TYPE_CHECKING:
    from mmp_planners.conflict_tree.fast_track import Attempt


class EventEmitter:
    """Makes events for one watcher."""

    def __init__(self, watch: events.Watcher, arms: PlanningContext) -> None:
        self._watch = None if watch is events.ignore else watch
        self._arms = arms
        self._began = time.perf_counter()

    def search_started(self, restart: int, sub_seed: int) -> None:
        if self._watch:
            self._watch(events.SearchStarted(elapsed_s=self._elapsed(), restart=restart, sub_seed=sub_seed))

    def created(self, node: Node, arm: int | None, constraint: str | None) -> None:
        if self._watch:
            self._watch(
                events.NodeCreated(
                    elapsed_s=self._elapsed(),
                    node=node.id,
                    parent=node.parent,
                    arm=None if arm is None else self._arms.names[arm],
                    constraint=constraint,
                    paths={name: path.q for name, path in zip(self._arms.names, node.paths, strict=True)},
                    cost_rad=node.cost,
                    lower_bound_rad=node.lower_bound,
                    conflicts=node.conflict_count,
                    conflicting_pairs=len(node.conflicts),
                    fast_track=arm is not None and constraint is None,
                    dt_s=self._arms.dt,
                )
            )

    def expanded(self, node: Node, open_nodes: int, expanded: int) -> None:
        if self._watch:
            self._watch(
                events.NodeExpanded(
                    elapsed_s=self._elapsed(),
                    node=node.id,
                    open_nodes=open_nodes,
                    expanded_nodes=expanded,
                    conflicts=node.conflict_count,
                )
            )

    def conflict(self, node: Node, meeting: ConflictInterval) -> None:
        if self._watch:
            self._watch(
                events.ConflictChosen(
                    elapsed_s=self._elapsed(),
                    node=node.id,
                    arm_a=self._arms.names[meeting.a],
                    arm_b=self._arms.names[meeting.b],
                    start_s=meeting.first * self._arms.dt,
                    end_s=meeting.last * self._arms.dt,
                )
            )

    def replanned(self, arm: int, constraints: int, found: bool, iterations: int, tries: int) -> None:
        if self._watch:
            self._watch(
                events.Replanned(
                    elapsed_s=self._elapsed(),
                    arm=self._arms.names[arm],
                    constraints=constraints,
                    found=found,
                    iterations=iterations,
                    tries=tries,
                )
            )

    def repelled(self, arm: int, before: Path, modified: Modified) -> None:
        if self._watch:
            self._watch(
                events.Repelled(
                    elapsed_s=self._elapsed(),
                    arm=self._arms.names[arm],
                    before=before.q,
                    after=modified.path.q,
                    iterations=modified.iterations,
                    iterates=modified.iterates,
                    field=modified.field,
                )
            )

    def fast_tracked(self, node: Node, attempt: Attempt) -> None:
        if self._watch:
            self._watch(
                events.FastTracked(
                    elapsed_s=self._elapsed(), node=node.id, arm=self._arms.names[attempt.arm], solved=attempt.solved
                )
            )

    def solved(self, node: Node, clearance: float) -> None:
        if self._watch:
            self._watch(
                events.SolutionFound(elapsed_s=self._elapsed(), node=node.id, cost_rad=node.cost, clearance_m=clearance)
            )

    def _elapsed(self) -> float:
        return time.perf_counter() - self._began
