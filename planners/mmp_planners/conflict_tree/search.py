"""The conflict-tree search of every planner of the CBS family, with the steps of APF-ECBS.

The search is CBS (Sharon, Stern, Felner, Sturtevant: Conflict-based search for optimal multi-agent pathfinding,
Artificial Intelligence 219, 2015) with a focal list (ECBS: Barer, Sharon, Stern, Felner: Suboptimal variants of the
conflict-based search algorithm, SoCS 2014). Its parts are handed in: selection, choice of conflict, constraint kind,
expansion, experience, modification and fast track. Numbers `l. n` are lines of our listing of Algorithm 1 of APF-ECBS
(Hong, Lee, Lee, Nam, arXiv 2509.13882, 2025) in `docs/explanation/paper.md`.

Trees of one search differ in the seed, the choice of conflict, and the instants and the reach of constraints.

Guarantee: every returned plan has a certificate. LB is the least bound of all leaves of the tree: of OPEN and of the
nodes without conflicts. The bounds are the planner's own path lengths, not the least that exist; with `absolute_bound`
LB is that of the straight lines, which no plan is below. `exhausted` proves nothing with any constraint kind, because
the low level samples.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from mmp_planners.conflict_tree.conflict_choice import ConflictChoice
from mmp_planners.conflict_tree.constraints import INSTANTS, ConstraintKind
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.expansion import EagerExpansion, Expansion, Experience, FromScratch
from mmp_planners.conflict_tree.fast_track import FastTrack, NoFastTrack
from mmp_planners.conflict_tree.node import Node, settled_paths
from mmp_planners.conflict_tree.node_factory import NodeFactory
from mmp_planners.conflict_tree.repulsion import Modification, NoModification
from mmp_planners.conflict_tree.selection import Selection
from mmp_planners.counts import Incumbent, TreeCounts
from mmp_planners.planning_context import PlanningContext
from mmp_planners.seeds import sub_seeds

ROOT_TRIES = 3
"""Number of trees in a row without a root before the search is exhausted."""
RESTART_EXPANSIONS = 8
"""Number of expansions without fewer pairs of arms in conflict before the first restart."""
RESTART_GROWTH = 1.2
"""Growth of that number from one restart to the next."""
NODE_RELEASE_S = 30e-6
"""Time that is reserved at the end to release the memory of an open node [s]."""


@dataclass(kw_only=True)
class ConflictTree:
    """One search. After a restart arms without conflicts keep their paths from the last tree, and the others begin with
    paths that are clear of these, where they find one (independence detection: Standley: Finding optimal solutions to
    cooperative pathfinding problems, AAAI 2010).

    `best` is the cheapest certified solution so far, also after a watcher stops the search.
    """

    context: PlanningContext
    selection: Selection
    branching: ConstraintKind
    emitter: EventEmitter
    choice: ConflictChoice = field(default_factory=ConflictChoice)
    expansion: Expansion = field(default_factory=EagerExpansion)
    experience: Experience = field(default_factory=FromScratch)
    modification: Modification = field(default_factory=NoModification)
    fast_track: FastTrack = field(default_factory=NoFastTrack)
    restarts: bool = True
    patience: int = 20
    absolute_bound: float | None = None
    """Length of the straight lines [rad], or None: LB is of the planner's own path lengths."""
    counts: TreeCounts = field(default_factory=TreeCounts)
    best: Incumbent | None = None
    began: float = field(default_factory=time.perf_counter)
    """Start of the run by `time.perf_counter()` [s]."""
    found_s: float | None = None
    """Time from the start of the run to the first solution [s]."""
    exhausted: bool = False
    failed_trees: int = 0
    good_cost: float = 0.0
    """Largest cost [rad] that meets the bound, when `best` was last tested."""

    def __post_init__(self) -> None:
        self._tree_number = 0
        self._closest: Node | None = None
        self._solved_bound = math.inf  # least bound of the nodes without conflicts
        self._factory = NodeFactory(
            context=self.context,
            modification=self.modification,
            experience=self.experience,
            counts=self.counts,
            emitter=self.emitter,
        )

    def run(self, seed: int) -> bool:
        """Searches until a solution is good enough, the search is exhausted, or time is up.

        Returns:
            Whether the search was exhausted.

        Raises:
            StopPlanning: if a watcher raises it.
        """
        for _ in self.steps(seed):
            pass
        return self.exhausted

    def steps(self, seed: int) -> Iterator[None]:
        """Yields after each expansion, until a solution is good enough, the search is exhausted, or time is up."""
        budget, rootless, settled, bounds = float(RESTART_EXPANSIONS), 0, {}, ()
        for restart, sub_seed in enumerate(sub_seeds(seed)):
            if self.context.clock.expired:
                return
            self.emitter.search_started(restart, sub_seed)
            self._tree_number = restart
            root = self._factory.root(sub_seed, settled, bounds)
            rootless = rootless + 1 if root is None else 0
            if rootless >= (ROOT_TRIES if self.restarts else 1):  # an arm finds no path even alone
                self.exhausted = not self.context.clock.expired
                return
            if root is not None and (yield from self._search(root, int(budget) if self.restarts else None)):
                self.exhausted = self.best is None and not self.context.clock.expired
                return
            self.failed_trees += 1
            settled, bounds = ({}, ()) if root is None else (settled_paths(self._closest or root), root.bounds)
            yield
            self.counts.restarts += 1
            budget *= RESTART_GROWTH

    def _search(self, root: Node, budget: int | None) -> Generator[None, None, bool]:
        """Searches one tree, and yields after each expansion, until `budget` expansions in a row brought no progress.

        Progress is a node with fewer pairs of arms in conflict than any before. Returns whether the whole run is done.
        """
        open_nodes, self._solved_bound = [root], math.inf  # l. 1-4
        self._closest, self._progress = root, self.counts.expanded_nodes
        if not root.conflicts:
            open_nodes.clear()
            self._offer(root, open_nodes)  # returns to the open list if its plan cannot be proved
        while not self._is_out_of_time(open_nodes):  # l. 5
            bound = self._lower_bound(open_nodes)
            if self.best is not None:  # l. 7-8
                self.good_cost = self.selection.w * bound
                self.best = dataclasses.replace(self.best, bound_met=self.best.cost <= self.good_cost)
                if self._is_good_enough(self.best, open_nodes):
                    return True
            if not open_nodes:
                return budget is None
            if self.best is None and budget is not None and self.counts.expanded_nodes - self._progress >= budget:
                return False
            node = self.selection(open_nodes, bound)  # l. 6
            if not node.conflicts:  # a fast track replaced the node that it comes from
                open_nodes.remove(node)
                self._offer(node, open_nodes)
                continue
            if node.pending:  # lazy expansion: replanned now, and put back
                open_nodes.remove(node)
                self._replan(node, open_nodes)
                continue
            if not node.fast_tracked and self._try_fast_track(node, open_nodes):  # l. 9-14
                continue
            open_nodes.remove(node)  # l. 25
            self.counts.expanded_nodes += 1
            self.emitter.node_expanded(node, len(open_nodes), self.counts.expanded_nodes)
            self._branch(node, open_nodes)  # l. 15-24
            yield
        return True

    def _is_out_of_time(self, open_nodes: Sequence[Node]) -> bool:
        self.context.clock.reserve(NODE_RELEASE_S * len(open_nodes))
        return self.context.clock.expired

    def _lower_bound(self, open_nodes: Sequence[Node]) -> float:
        """Returns LB [rad]: the least bound of all leaves, or that of the straight lines."""
        if self.absolute_bound is not None:
            return self.absolute_bound
        return min([self._solved_bound, *(node.lower_bound for node in open_nodes)])

    def _is_good_enough(self, best: Incumbent, open_nodes: Sequence[Node]) -> bool:
        waited = self.counts.expanded_nodes - best.found_expansion >= self.patience
        return bool(best.bound_met) or waited or not open_nodes

    def _branch(self, node: Node, open_nodes: list[Node]) -> None:
        interval = self.choice(node, self._tree_number)  # l. 15
        instant = INSTANTS[self._tree_number % len(INSTANTS)]
        self.emitter.conflict_chosen(node, interval)
        for branch in self.branching.branches(self.context, node.paths, interval, instant):  # l. 16
            child = node.child(branch)  # l. 17-18
            self.expansion(child, open_nodes, lambda child: self._replan(child, open_nodes))

    def _replan(self, child: Node, open_nodes: list[Node]) -> None:
        if self.context.clock.expired or not self._factory.replan(child):  # l. 19-23
            return
        if child.conflicts:
            open_nodes.append(child)  # l. 24
            self._note_progress(child)
            if self.fast_track.on_children:  # ours: l. 9-14 at once
                self._try_fast_track(child, open_nodes)
        else:
            self._offer(child, open_nodes)

    def _note_progress(self, node: Node) -> None:
        if node.conflicts and self._closest is not None and len(node.conflicts) < len(self._closest.conflicts):
            self._closest, self._progress = node, self.counts.expanded_nodes

    def _try_fast_track(self, node: Node, open_nodes: list[Node]) -> bool:
        """Returns whether an attempt solved the node or replaced it by a node with fewer conflicts.

        A node that takes the place of another is open like any other. Otherwise the node stays open, and is branched if
        the solution is not good enough.
        """
        node.fast_tracked = True
        for attempt in self.fast_track(self.context, node):
            self.counts.fast_track_tries += 1
            self.counts.fast_track_hits += attempt.solved
            self.emitter.fast_tracked(node, attempt)
            if not attempt.solved and not attempt.replaces:
                continue
            attempt.node.id, attempt.node.parent = self.counts.next_node(), node.id
            arm = attempt.arms[0] if len(attempt.arms) == 1 else None
            self.emitter.node_created(attempt.node, arm, None, fast_track=True)
            if attempt.replaces:
                open_nodes[open_nodes.index(node)] = attempt.node
                self._note_progress(attempt.node)
            else:
                self._offer(attempt.node, open_nodes)
            return True
        return False

    def _offer(self, node: Node, open_nodes: list[Node]) -> None:
        """Makes a node without conflicts the incumbent, if it is cheaper and its plan can be certified."""
        if (self.best is None or node.cost < self.best.cost) and not self._certified(node, open_nodes):
            return
        self._solved_bound = min(self._solved_bound, node.lower_bound)

    def _certified(self, node: Node, open_nodes: list[Node]) -> bool:
        """Returns whether the plan of a node can be certified, and has made it the incumbent then."""
        plan = self.context.plan(node.paths)
        proof = self.context.certify(plan)
        if proof.valid:
            if self.found_s is None:
                self.found_s = time.perf_counter() - self.began
            self.best = Incumbent(
                plan=plan,
                cost=node.cost,
                clearance=proof.clearance,
                found_expansion=self.counts.expanded_nodes,
                node=node.id,
            )
            self.emitter.solution_found(node, proof.clearance)
        elif not self.context.clock.expired:
            # The planner's own tests missed it: between arms it is a conflict like any other.
            self.counts.failed_certificates += 1
            if proof.arms[1] >= 0:
                node.update(conflicts={proof.arms: np.array([proof.instant])})
                open_nodes.append(node)
        return proof.valid
