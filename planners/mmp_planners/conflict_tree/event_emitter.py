"""Emits the events of a search to its watcher. It costs nothing without a watcher."""

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
    """Makes events for one watcher from nodes, intervals and paths of a planning context."""

    def __init__(self, watch: events.Watcher, context: PlanningContext) -> None:
        self._watch = None if watch is events.ignore else watch
        self._context = context
        self._began = time.perf_counter()

    def search_started(self, restart: int, sub_seed: int) -> None:
        if self._watch:
            self._watch(events.SearchStarted(elapsed_s=self._elapsed(), restart=restart, sub_seed=sub_seed))

    def node_created(self, node: Node, arm: int | None, constraint: str | None, *, fast_track: bool = False) -> None:
        if self._watch:
            self._watch(
                events.NodeCreated(
                    elapsed_s=self._elapsed(),
                    node=node.id,
                    parent=node.parent,
                    arm=None if arm is None else self._context.names[arm],
                    constraint=constraint,
                    paths={name: path.q for name, path in zip(self._context.names, node.paths, strict=True)},
                    cost_rad=node.cost,
                    lower_bound_rad=node.lower_bound,
                    conflicts=node.conflict_count,
                    conflicting_pairs=len(node.conflicts),
                    fast_track=fast_track,
                    dt_s=self._context.dt,
                )
            )

    def node_expanded(self, node: Node, open_nodes: int, expanded: int) -> None:
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

    def conflict_chosen(self, node: Node, interval: ConflictInterval) -> None:
        if self._watch:
            self._watch(
                events.ConflictChosen(
                    elapsed_s=self._elapsed(),
                    node=node.id,
                    arm_a=self._context.names[interval.a],
                    arm_b=self._context.names[interval.b],
                    start_s=interval.first * self._context.dt,
                    end_s=interval.last * self._context.dt,
                )
            )

    def replanned(self, arm: int, constraints: int, found: bool, iterations: int, tries: int) -> None:
        if self._watch:
            self._watch(
                events.Replanned(
                    elapsed_s=self._elapsed(),
                    arm=self._context.names[arm],
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
                    arm=self._context.names[arm],
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
                    elapsed_s=self._elapsed(),
                    node=node.id,
                    arms=tuple(self._context.names[arm] for arm in attempt.arms),
                    solved=attempt.solved,
                )
            )

    def solution_found(self, node: Node, clearance: float) -> None:
        if self._watch:
            self._watch(
                events.SolutionFound(elapsed_s=self._elapsed(), node=node.id, cost_rad=node.cost, clearance_m=clearance)
            )

    def _elapsed(self) -> float:
        return time.perf_counter() - self._began
