"""The conflict-tree search that every planner of the CBS family is a composition of.

CBS (Sharon et al. 2015) and ECBS (Barer et al. 2014) with the parts handed in: which node is taken, what a branch
forbids, what happens to a path after replanning, and what is tried before branching. Numbers `l. n` are lines of
Algorithm 1 of APF-ECBS (arXiv 2509.13882) as `docs/paper.md` gives them.

Guarantee: a plan that is returned has a certificate. None of the constraint kinds is complete, so `exhausted` proves
nothing; and with a sampling low level the bounds are the planner's own path lengths, not the best that exist.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.plan import Plan
from mmp_planners.arms import Arms, Path
from mmp_planners.constraints import INSTANTS, ConstraintKind, Meeting
from mmp_planners.fast_track import FastTrack
from mmp_planners.node import Node
from mmp_planners.planner import StopPlanning
from mmp_planners.repulsion import Modification
from mmp_planners.selection import Selection
from mmp_planners.telling import Teller

REPLAN_TRIES = 3
REPLAN_GROWTH = 2.0
ROOT_TRIES = 3
RESTART_EXPANSIONS = 20
RESTART_GROWTH = 1.2


@dataclass(kw_only=True)
class Counts:
    """What a run counts; the same run gives the same counts."""

    expanded_nodes: int = 0
    generated_nodes: int = 0
    low_level_calls: int = 0
    dropped_children: int = 0
    repulsions: int = 0
    fast_track_tries: int = 0
    fast_track_hits: int = 0
    restarts: int = 0
    failed_certificates: int = 0
    root_conflicts: int | None = None


@dataclass(kw_only=True)
class Incumbent:
    """The best solution so far: its plan and what was proved of it."""

    plan: Plan
    cost: float
    clearance: float
    found_at: int
    bound_met: bool = False


@dataclass(kw_only=True)
class ConflictTree:
    """One search. `best` stands after a stop in the middle as after a regular end."""

    arms: Arms
    selection: Selection
    branching: ConstraintKind
    modification: Modification
    fast_track: FastTrack
    tell: Teller
    restarts: bool = True
    patience: int = 20
    counts: Counts = field(default_factory=Counts)
    best: Incumbent | None = None

    def run(self, seed: int) -> bool:
        """Searches until a solution is good enough, constraints are used up, or time is; True if used up in time."""
        seeds = np.random.SeedSequence(seed)
        budget, rootless = float(RESTART_EXPANSIONS), 0
        try:
            while not self.arms.clock.expired:
                sub_seed = int(seeds.spawn(1)[0].generate_state(1, np.uint64)[0] >> 1)
                self.tell.search_started(self.counts.restarts, sub_seed)
                instant = INSTANTS[self.counts.restarts % len(INSTANTS)]
                root = self._root(sub_seed)
                rootless = rootless + 1 if root is None else 0
                if rootless >= (ROOT_TRIES if self.restarts else 1):  # an arm that finds no way even alone
                    return not self.arms.clock.expired
                if root is not None and self._search(root, sub_seed, instant, int(budget) if self.restarts else None):
                    return self.best is None and not self.arms.clock.expired
                self.counts.restarts += 1
                budget *= RESTART_GROWTH
        except StopPlanning:
            pass
        return False

    def _search(self, root: Node, seed: int, instant: str, budget: int | None) -> bool:
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
            if not node.fast_tracked and self._try_fast_track(node, open_nodes):  # l. 9-14
                continue
            open_nodes.remove(node)  # l. 25
            self.counts.expanded_nodes += 1
            self.tell.expanded(node, len(open_nodes), self.counts.expanded_nodes)
            self._branch(node, seed, instant, open_nodes)  # l. 15-24
        return True

    def _good_enough(self, best: Incumbent, bound: float, open_nodes: Sequence[Node]) -> bool:
        best.bound_met = best.cost <= self.selection.w * bound
        waited = self.counts.expanded_nodes - best.found_at >= self.patience
        return best.bound_met or waited or not open_nodes

    def _root(self, seed: int) -> Node | None:
        """Every arm on its own; not modified by repulsion."""
        self.arms.reseed(seed)
        paths: list[Path] = []
        for arm in range(len(self.arms.names)):
            path = self._replan(arm, (), (seed, 0, arm))
            if path is None:
                return None
            paths.append(path)
        conflicts = self.arms.conflicts(paths, self.arms.pairs())
        node = Node(
            id=self._next_id(),
            parent=None,
            paths=tuple(paths),
            constraints=tuple(() for _ in paths),
            bounds=tuple(path.length for path in paths),
            conflicts=conflicts,
        )
        if self.counts.root_conflicts is None:
            self.counts.root_conflicts = node.conflict_count
        self.tell.created(node, None, None)
        return node

    def _branch(self, node: Node, seed: int, instant: str, open_nodes: list[Node]) -> None:
        meeting = node.first_conflict()  # l. 15
        self.tell.conflict(node, meeting)
        for arm in (meeting.a, meeting.b):  # l. 16
            child = self._child(node, meeting, arm, seed, instant)
            if child is None:  # l. 23
                self.counts.dropped_children += 1
            elif child.conflicts:
                open_nodes.append(child)  # l. 24
            else:
                self._offer(child, open_nodes)

    def _child(self, node: Node, meeting: Meeting, arm: int, seed: int, instant: str) -> Node | None:
        added = self.branching.forbid(self.arms, node.paths, meeting, arm, instant)
        constraints = (*node.constraints[arm], *added)  # l. 18
        number = self._next_id()
        path = self._replan(arm, constraints, (seed, number, arm))  # l. 19
        if path is None:
            return None
        bounds = (*node.bounds[:arm], path.length, *node.bounds[arm + 1 :])
        paths = (*node.paths[:arm], path, *node.paths[arm + 1 :])
        modified = self.modification(self.arms, paths, arm, constraints)  # l. 20
        if modified is not None:
            self.counts.repulsions += 1
            self.tell.repelled(arm, path, modified)
            path = modified.path
        paths, conflicts = node.replaced(self.arms, arm, path)  # l. 21-22
        child = Node(
            id=number,
            parent=node.id,
            paths=paths,
            constraints=(*node.constraints[:arm], constraints, *node.constraints[arm + 1 :]),
            bounds=bounds,
            conflicts=conflicts,
        )
        self.tell.created(child, arm, self.branching.words(self.arms, meeting, arm))
        return child

    def _replan(self, arm: int, constraints: Sequence[Any], key: tuple[int, int, int]) -> Path | None:
        """The low level, with a growing budget; the seed depends on the node alone, not on what ran before."""
        for attempt in range(REPLAN_TRIES):
            seed = int(np.random.SeedSequence((*key, attempt)).generate_state(1, np.uint64)[0])
            self.counts.low_level_calls += 1
            path, iterations = self.arms.low_level(arm, constraints, seed, REPLAN_GROWTH**attempt)
            self.tell.replanned(arm, len(constraints), path is not None, iterations, attempt + 1)
            if path is not None or self.arms.clock.expired:
                return path
        return None

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
                attempt.node.id, attempt.node.parent = self._next_id(), node.id
                self.tell.created(attempt.node, attempt.arm, None)
                self._offer(attempt.node, open_nodes)
                return True
        return False

    def _offer(self, node: Node, open_nodes: list[Node]) -> None:
        """A node without conflicts: the incumbent, if it is cheaper and its plan can be proved safe."""
        if self.best is not None and node.cost >= self.best.cost:
            return
        plan = self.arms.plan(node.paths, {}, {})
        valid, clearance, (a, b), instant = self.arms.certify(plan)
        if valid:
            self.best = Incumbent(plan=plan, cost=node.cost, clearance=clearance, found_at=self.counts.expanded_nodes)
            self.tell.solved(node, clearance)
        elif not self.arms.clock.expired:
            # Something that the planner's own checks missed: between arms it is a conflict like any other.
            self.counts.failed_certificates += 1
            if b >= 0:
                node.conflicts = {(a, b): np.array([instant])}
                open_nodes.append(node)

    def _next_id(self) -> int:
        number = self.counts.generated_nodes
        self.counts.generated_nodes += 1
        return number


def bound_or_infinity(limit: float) -> float:
    """A time limit as the native clock takes it [s]. Raises `MmpError` for NaN."""
    if math.isnan(limit):
        raise MmpError("time_limit is nan; it must be a number of seconds, inf for none")
    return min(max(limit, 0.0), 1e10)
