"""Makes the nodes of a conflict tree: its root, and its children once their arm is replanned.

Numbers `l. n` are lines of our listing of Algorithm 1 of APF-ECBS in `docs/explanation/paper.md`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from mmp_env import core
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.expansion import Experience
from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.repulsion import Modification
from mmp_planners.counts import TreeCounts
from mmp_planners.planning_context import Path, PlanningContext
from mmp_planners.seeds import seed_of

REPLAN_TRIES = 3
"""Number of low-level calls with different seeds before a child is dropped."""
REPLAN_GROWTH = 2.0
"""Growth of the iteration budget from one call to the next."""


@dataclass(kw_only=True)
class NodeFactory:
    """Plans the paths of nodes, numbers and counts the nodes, and emits their events. `seed` is the current tree's."""

    context: PlanningContext
    modification: Modification
    experience: Experience
    counts: TreeCounts
    emitter: EventEmitter
    seed: int = 0

    def root(
        self, seed: int, settled: Mapping[int, Path] = MappingProxyType({}), bounds: Sequence[float] = ()
    ) -> Node | None:
        """Returns a root without constraints and repulsion, or None when an arm finds no path or time is up.

        Without `settled` each arm is planned alone, and the length of its path is its bound. Otherwise the arms in
        `settled` have these paths, the others are planned clear of them if possible, and no bound is above the given
        `bounds` [rad], those of a root whose arms were planned alone.
        """
        self.seed = seed
        self.context.reseed(seed)
        paths: list[Path] = []
        others = tuple(settled.values())
        for arm in range(len(self.context.names)):
            if self.context.clock.expired:
                return None
            path = settled.get(arm)
            if path is None and others:
                path = self._plan(arm, (), seed_of(seed, 0, arm, REPLAN_TRIES), others=others)
            if path is None and not self.context.clock.expired:
                path = self._replan(arm, (), (seed, 0, arm), None)
            if path is None:
                return None
            paths.append(path)
        conflicts = self.context.conflicts(paths, self.context.pairs())
        lengths = tuple(path.length for path in paths)
        node = Node(
            id=self.counts.next_node(),
            parent=None,
            paths=tuple(paths),
            constraints=tuple(() for _ in paths),
            bounds=tuple(map(min, lengths, bounds)) if settled else lengths,
            conflicts=conflicts,
        )
        if self.counts.root_conflicts is None:
            self.counts.root_conflicts = node.conflict_count
        self.emitter.node_created(node, None, None)
        return node

    def replan(self, child: Node) -> bool:
        """Plans the arm of a pending child, l. 19-22. Returns whether it has a path; else it counts as dropped."""
        branch = child.pending
        if branch is None:
            return True
        number, arm, before = self.counts.next_node(), branch.arm, child.paths[branch.arm]
        constraints = child.constraints[arm]
        path = self._replan(arm, constraints, (self.seed, number, arm), self.experience(before))  # l. 19
        if path is None:
            self.counts.dropped_children += not self.context.clock.expired
            return False
        child.id, child.pending = number, None
        bounds = (*child.bounds[:arm], path.length, *child.bounds[arm + 1 :])
        paths = (*child.paths[:arm], path, *child.paths[arm + 1 :])
        modified = self.modification(self.context, paths, arm, constraints)  # l. 20
        if modified is not None:
            self.counts.repulsions += 1
            self.emitter.repelled(arm, path, modified)
            path = modified.path
        paths, conflicts = child.replaced(self.context, arm, path)  # l. 21-22
        child.update(paths=paths, bounds=bounds, conflicts=conflicts)
        self.emitter.node_created(child, arm, branch.description)
        return True

    def _replan(
        self, arm: int, constraints: Sequence[core.Constraint], key: tuple[int, int, int], experience: Path | None
    ) -> Path | None:
        """Calls the low level with a growing budget. The seed depends on the node alone, not on what ran before."""
        for attempt in range(REPLAN_TRIES):
            seed = seed_of(*key, attempt)
            path = self._plan(arm, constraints, seed, attempt=attempt, experience=experience)
            if path is not None or self.context.clock.expired:
                return path
        return None

    def _plan(
        self,
        arm: int,
        constraints: Sequence[core.Constraint],
        seed: int,
        *,
        attempt: int = 0,
        others: Sequence[Path] = (),
        experience: Path | None = None,
    ) -> Path | None:
        """Calls the low level once."""
        self.counts.low_level_calls += 1
        path, iterations = self.context.low_level(
            arm,
            constraints,
            seed,
            REPLAN_GROWTH**attempt,
            others=others,
            experience=None if experience is None else experience.q,
        )
        self.emitter.replanned(arm, len(constraints), path is not None, iterations, attempt + 1)
        return path
