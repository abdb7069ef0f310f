"""Nodes of the conflict tree: paths, constraints, bounds and conflicts."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mmp_env import core
from mmp_planners.conflict_tree.constraints import Branch, ConflictInterval
from mmp_planners.planning_context import PairConflicts, Path, PlanningContext

UNNUMBERED = -1
MovedInVain = dict[int, tuple[Path, ...]]
"""Arm that a fast track has moved in vain -> all paths of that moment."""


@dataclass(kw_only=True, eq=False)
class Node:
    """N: one path T_i per arm, the constraints that the paths satisfy, and the conflicts that are left.

    `bounds` holds each arm's lb_i [rad]: the length of its planned path before repulsion, or in a root after a restart
    that of an earlier path if it is shorter. `kinds` holds the numbers of the constraint kinds from the root to this
    node. While a branch is `pending`, the node has its constraints and no number; paths, bounds and conflicts are still
    the parent's. Only `update` changes paths, bounds and conflicts. Children begin with the arms that a fast track has
    moved in vain (`vain`, and `vain_resort` by its last resort).
    """

    id: int
    parent: int | None
    paths: tuple[Path, ...]
    constraints: tuple[tuple[core.Constraint, ...], ...]
    bounds: tuple[float, ...]
    conflicts: PairConflicts
    fast_tracked: bool = False
    kinds: tuple[int, ...] = ()
    pending: Branch | None = None
    vain: MovedInVain = field(default_factory=dict)
    vain_resort: MovedInVain = field(default_factory=dict)

    @cached_property
    def cost(self) -> float:
        """sum_i |T_i|_1 [rad]."""
        return sum(path.length for path in self.paths)

    @cached_property
    def lower_bound(self) -> float:
        return sum(self.bounds)

    @cached_property
    def conflict_count(self) -> int:
        """Number of conflicts as triples (i, j, k), k over whole steps."""
        return sum(len(instants) for instants in self.conflicts.values())

    def update(
        self,
        *,
        paths: tuple[Path, ...] | None = None,
        bounds: tuple[float, ...] | None = None,
        conflicts: PairConflicts | None = None,
    ) -> None:
        """Replaces paths, bounds or conflicts, and drops what was computed from the old ones."""
        new = {"paths": paths, "bounds": bounds, "conflicts": conflicts}
        vars(self).update({key: value for key, value in new.items() if value is not None})
        for known in ("cost", "lower_bound", "conflict_count"):
            vars(self).pop(known, None)

    def share(self, kind: int) -> float:
        """Returns the share of the branches from the root to this node that are of that kind."""
        return self.kinds.count(kind) / len(self.kinds) if self.kinds else 0.0

    def first_conflict(self) -> ConflictInterval:
        """Returns the earliest conflict, then that of the first pair."""
        return self._interval(*min(self.conflicts, key=self._time))

    def isolated_conflict(self) -> ConflictInterval:
        """Returns the earliest conflict of the pairs whose arms are in the fewest other pairs."""
        pairs_of = Counter(arm for pair in self.conflicts for arm in pair)
        return self._interval(
            *min(self.conflicts, key=lambda pair: (sum(pairs_of[arm] for arm in pair), self._time(pair)))
        )

    def is_late(self, pair: tuple[int, int]) -> bool:
        """Returns whether a pair has a conflict after one of its arms has arrived."""
        return bool(self.conflicts[pair][-1] > min(self.paths[arm].last for arm in pair))

    def _time(self, pair: tuple[int, int]) -> tuple[float, tuple[int, int]]:
        return float(self.conflicts[pair][0]), pair

    def _interval(self, a: int, b: int) -> ConflictInterval:
        """Returns the first unbroken run of instants of the conflict of a pair."""
        instants = self.conflicts[a, b]
        breaks = np.flatnonzero(np.diff(instants) > 1)
        last = instants[breaks[0]] if len(breaks) else instants[-1]
        lasting = bool(last >= max(self.paths[a].last, self.paths[b].last))
        return ConflictInterval(a=a, b=b, first=float(instants[0]), last=float(last), lasting=lasting)

    def common_arms(self) -> list[int]:
        """Returns the arms that are in every conflicting pair: both arms of a single pair, often none."""
        pairs = list(self.conflicts)
        return [arm for arm in sorted(set(pairs[0])) if all(arm in pair for pair in pairs)] if pairs else []

    def child(self, branch: Branch) -> Node:
        """Returns a child with the constraints of a branch, whose arm is still to be replanned."""
        arm = branch.arm
        kept = (*self.constraints[arm], *branch.constraints)
        return Node(
            id=UNNUMBERED,
            parent=self.id,
            paths=self.paths,
            constraints=(*self.constraints[:arm], kept, *self.constraints[arm + 1 :]),
            bounds=self.bounds,
            conflicts=self.conflicts,
            kinds=(*self.kinds, branch.kind),
            pending=branch,
            vain=self.vain,
            vain_resort=self.vain_resort,
        )

    def replaced(self, context: PlanningContext, arm: int, path: Path) -> tuple[tuple[Path, ...], PairConflicts]:
        """Returns the paths with a new path of `arm`, and their conflicts. Only pairs of that arm are tested again."""
        paths = (*self.paths[:arm], path, *self.paths[arm + 1 :])
        kept = {pair: instants for pair, instants in self.conflicts.items() if arm not in pair}
        return paths, {**kept, **context.conflicts(paths, context.pairs(arm))}


def settled_paths(node: Node) -> dict[int, Path]:
    """Returns the paths of all arms that are in no conflict of the node."""
    in_conflict = {arm for pair in node.conflicts for arm in pair}
    return {arm: path for arm, path in enumerate(node.paths) if arm not in in_conflict}
