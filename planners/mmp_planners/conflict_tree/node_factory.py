"""Where the nodes of a conflict tree come from: its root, and its children once their arm is replanned.

Numbers `l. n` are lines of Algorithm 1 of APF-ECBS as `docs/explanation/paper.md` gives them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import _core
from mmp_planners.conflict_tree.event_emitter import EventEmitter
from mmp_planners.conflict_tree.expansion import Experience
from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.repulsion import Modification
from mmp_planners.counts import Counts
from mmp_planners.planning_context import Path, PlanningContext
from mmp_planners.seeds import seed_of

REPLAN_TRIES = 3
REPLAN_GROWTH = 2.0


@dataclass(kw_only=True)
class NodeFactory:
    """Plans the paths of nodes, numbers, counts and tells of them. `seed` is that of the tree at hand."""

    arms: PlanningContext
    modification: Modification
    experience: Experience
    counts: Counts
    tell: EventEmitter
    seed: int = 0

    def root(self, seed: int) -> Node | None:
        """Every arm on its own, not modified by repulsion; None where one finds no way."""
        self.seed = seed
        self.arms.reseed(seed)
        paths: list[Path] = []
        for arm in range(len(self.arms.names)):
            path = self._replan(arm, (), (seed, 0, arm), None)
            if path is None:
                return None
            paths.append(path)
        conflicts = self.arms.conflicts(paths, self.arms.pairs())
        node = Node(
            id=self.counts.next_node(),
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

    def replan(self, child: Node) -> bool:
        """Plans the arm of a pending child, l. 19-22; False, and the child counts as dropped, where it finds no way."""
        branch = child.pending
        if branch is None:
            return True
        number, arm, before = self.counts.next_node(), branch.arm, child.paths[branch.arm]
        constraints = child.constraints[arm]
        path = self._replan(arm, constraints, (self.seed, number, arm), self.experience(before))  # l. 19
        if path is None:
            self.counts.dropped_children += not self.arms.clock.expired
            return False
        child.id, child.pending = number, None
        bounds = (*child.bounds[:arm], path.length, *child.bounds[arm + 1 :])
        paths = (*child.paths[:arm], path, *child.paths[arm + 1 :])
        modified = self.modification(self.arms, paths, arm, constraints)  # l. 20
        if modified is not None:
            self.counts.repulsions += 1
            self.tell.repelled(arm, path, modified)
            path = modified.path
        paths, conflicts = child.replaced(self.arms, arm, path)  # l. 21-22
        child.update(paths=paths, bounds=bounds, conflicts=conflicts)
        self.tell.created(child, arm, branch.words)
        return True

    def _replan(
        self, arm: int, constraints: Sequence[_core.Constraint], key: tuple[int, int, int], experience: Path | None
    ) -> Path | None:
        """The low level, with a growing budget; the seed depends on the node alone, not on what ran before."""
        known = None if experience is None else experience.q
        for attempt in range(REPLAN_TRIES):
            seed = seed_of(*key, attempt)
            self.counts.low_level_calls += 1
            path, iterations = self.arms.low_level(arm, constraints, seed, REPLAN_GROWTH**attempt, experience=known)
            self.tell.replanned(arm, len(constraints), path is not None, iterations, attempt + 1)
            if path is not None or self.arms.clock.expired:
                return path
        return None
