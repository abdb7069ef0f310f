"""The conflict-tree search that every planner of the CBS family is a composition of.

CBS (Sharon et al. 2015) and ECBS (Barer et al. 2014) with the parts handed in: which node is taken, what a branch
forbids, when a child is replanned and from what, what happens to its path then, and what is tried before branching.
Numbers `l. n` are lines of Algorithm 1 of APF-ECBS (arXiv 2509.13882) as `docs/explanation/paper.md` gives them.

Guarantee: a plan that is returned has a certificate. `exhausted` proves nothing, whatever the constraint kind: the low
level samples. And the bounds are the planner's own path lengths, not the best that exist.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from mmp_planners.conflict_tree.constraints import INSTANTS, ConstraintKind
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.expansion import EagerExpansion, Expansion, Experience, FromScratch
from mmp_planners.conflict_tree.fast_track import FastTrack, NoFastTrack
from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.node_factory import NodeFactory
from mmp_planners.conflict_tree.repulsion import Modification, Unmodified
from mmp_planners.conflict_tree.selection import Selection
from mmp_planners.counts import Counts, Incumbent
from mmp_planners.planning_context import PlanningContext
from mmp_planners.seeds import sub_seeds

ROOT_TRIES = 3
RESTART_EXPANSIONS = 20
RESTART_GROWTH = 1.2


@dataclass(kw_only=True)
class ConflictTree:
    """One search. `best` stands after a stop in the middle as after a regular end."""

    arms: PlanningContext
    selection: Selection
    branching: ConstraintKind
    tell: EventEmitter
    expansion: Expansion = field(default_factory=EagerExpansion)
    experience: Experience = field(default_factory=FromScratch)
    modification: Modification = field(default_factory=Unmodified)
    fast_track: FastTrack = field(default_factory=NoFastTrack)
    restarts: bool = True
    patience: int = 20
    counts: Counts = field(default_factory=Counts)
    best: Incumbent | None = None
    found_at: float | None = None
    """When the first solution was found, by `time.perf_counter()`."""
    exhausted: bool = False

    def __post_init__(self) -> None:
        self._nursery = NodeFactory(
            arms=self.arms,
            modification=self.modification,
            experience=self.experience,
            counts=self.counts,
            tell=self.tell,
        )

    def run(self, seed: int) -> bool:
        """Searches until a solution is good enough, constraints are used up, or time is; True if used up in time.

        What a watcher raises goes through.
        """
        for _ in self.rounds(seed):
            pass
        return self.exhausted

    def rounds(self, seed: int) -> Iterator[None]:
        """One tree each, until a solution is good enough, the constraints are used up (`exhausted`), or time is."""
        budget, rootless = float(RESTART_EXPANSIONS), 0
        for restart, sub_seed in enumerate(sub_seeds(seed)):
            if self.arms.clock.expired:
                return
            self.tell.search_started(restart, sub_seed)
            instant = INSTANTS[restart % len(INSTANTS)]
            root = self._nursery.root(sub_seed)
            rootless = rootless + 1 if root is None else 0
            if rootless >= (ROOT_TRIES if self.restarts else 1):  # an arm that finds no way even alone
                self.exhausted = not self.arms.clock.expired
                return
            if root is not None and self._search(root, instant, int(budget) if self.restarts else None):
                self.exhausted = self.best is None and not self.arms.clock.expired
                return
            yield
            self.counts.restarts += 1
            budget *= RESTART_GROWTH

    def _search(self, root: Node, instant: str, budget: int | None) -> bool:
        """One tree, at most `budget` expansions unless it has a solution; True if the whole run is done with it."""
        open_nodes, bound, first = [root], root.lower_bound, self.counts.expanded_nodes  # l. 1-4
        if not root.conflicts:
            open_nodes.clear()
            self._offer(root, open_nodes)  # comes back if it cannot be proved
        while not self.arms.clock.expired:  # l. 5
            bound = max(bound, min((n.lower_bound for n in open_nodes), default=bound))
            if self.best and self._good_enough(self.best, bound, open_nodes):  # l. 7-8
                return True
            if not open_nodes:
                return budget is None
            if self.best is None and budget is not None and self.counts.expanded_nodes - first >= budget:
                return False
            node = self.selection(open_nodes, bound)  # l. 6
            if node.pending:  # generated before, replanned now, and put back
                open_nodes.remove(node)
                self._replan(node, open_nodes)
                continue
            if not node.fast_tracked and self._try_fast_track(node, open_nodes):  # l. 9-14
                continue
            open_nodes.remove(node)  # l. 25
            self.counts.expanded_nodes += 1
            self.tell.expanded(node, len(open_nodes), self.counts.expanded_nodes)
            self._branch(node, instant, open_nodes)  # l. 15-24
        return True

    def _good_enough(self, best: Incumbent, bound: float, open_nodes: Sequence[Node]) -> bool:
        best.bound_met = best.cost <= self.selection.w * bound
        waited = self.counts.expanded_nodes - best.found_at >= self.patience
        return best.bound_met or waited or not open_nodes

    def _branch(self, node: Node, instant: str, open_nodes: list[Node]) -> None:
        meeting = node.first_conflict()  # l. 15
        self.tell.conflict(node, meeting)
        for branch in self.branching.branches(self.arms, node.paths, meeting, instant):  # l. 16
            child = node.child(branch)  # l. 17-18
            self.expansion(child, open_nodes, lambda child: self._replan(child, open_nodes))

    def _replan(self, child: Node, open_nodes: list[Node]) -> None:
        if not self._nursery.replan(child):  # l. 19-23
            return
        if child.conflicts:
            open_nodes.append(child)  # l. 24
        else:
            self._offer(child, open_nodes)

    def _try_fast_track(self, node: Node, open_nodes: list[Node]) -> bool:
        """True if it gave a solution; the node stays open, and is branched only if that is not good enough."""
        node.fast_tracked = True
        for attempt in self.fast_track(self.arms, node):
            self.counts.fast_track_tries += 1
            self.tell.fast_tracked(node, attempt)
            if attempt.solved:
                self.counts.fast_track_hits += 1
                if not node.conflicts:  # literal: the node is the solution, nothing is left to branch
                    open_nodes.remove(node)
                attempt.node.id, attempt.node.parent = self.counts.next_node(), node.id
                self.tell.created(attempt.node, attempt.arm, None)
                self._offer(attempt.node, open_nodes)
                return True
        return False

    def _offer(self, node: Node, open_nodes: list[Node]) -> None:
        """A node without conflicts: the incumbent, if it is cheaper and its plan can be proved safe."""
        if self.best is not None and node.cost >= self.best.cost:
            return
        plan = self.arms.plan(node.paths)
        proof = self.arms.certify(plan)
        if proof.valid:
            self.found_at = self.found_at or time.perf_counter()
            self.best = Incumbent(
                plan=plan,
                cost=node.cost,
                clearance=proof.clearance,
                found_at=self.counts.expanded_nodes,
                node=node.id,
            )
            self.tell.solved(node, proof.clearance)
        elif not self.arms.clock.expired:
            # Something that the planner's own checks missed: between arms it is a conflict like any other.
            self.counts.failed_certificates += 1
            if proof.arms[1] >= 0:
                node.update(conflicts={proof.arms: np.array([proof.instant])})
                open_nodes.append(node)
