"""Nodes of the conflict tree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mmp_env import _core
from mmp_planners.conflict_tree.constraints import Branch, ConflictInterval
from mmp_planners.planning_context import PairConflicts, Path, PlanningContext

UNNUMBERED = -1


@dataclass(kw_only=True, eq=False)
class Node:
    """N: one path T_i per arm, the constraints that they keep, and the conflicts that are left.

    `bounds` holds each arm's lb_i [rad]: the length of its planned path before repulsion. `kinds` are the numbers of
    the constraint kinds on the way from the root. While a branch is `pending` its constraints are among those of the
    node, but paths, bounds and conflicts are still the parent's, and the node has no number yet. What changes in a node
    changes by `update`.
    """

    id: int
    parent: int | None
    paths: tuple[Path, ...]
    constraints: tuple[tuple[_core.Constraint, ...], ...]
    bounds: tuple[float, ...]
    conflicts: PairConflicts
    fast_tracked: bool = False
    kinds: tuple[int, ...] = ()
    pending: Branch | None = None

    @cached_property
    def cost(self) -> float:
        """sum_i |T_i|_1 [rad]."""
        return sum(path.length for path in self.paths)

    @cached_property
    def lower_bound(self) -> float:
        return sum(self.bounds)

    @cached_property
    def conflict_count(self) -> int:
        """Conflicts as triples (i, j, k), k over whole steps."""
        return sum(len(instants) for instants in self.conflicts.values())

    def update(
        self,
        *,
        paths: tuple[Path, ...] | None = None,
        bounds: tuple[float, ...] | None = None,
        conflicts: PairConflicts | None = None,
    ) -> None:
        """Other paths, bounds or conflicts; what is known of the old ones is forgotten."""
        new = {"paths": paths, "bounds": bounds, "conflicts": conflicts}
        vars(self).update({key: value for key, value in new.items() if value is not None})
        for known in ("cost", "lower_bound", "conflict_count"):
            vars(self).pop(known, None)

    def share(self, kind: int) -> float:
        """Which part of the branches that led here are of that kind."""
        return self.kinds.count(kind) / len(self.kinds) if self.kinds else 0.0

    def first_conflict(self) -> ConflictInterval:
        """The earliest conflict (then the first pair): its unbroken run of instants."""
        a, b = min(self.conflicts, key=lambda pair: (float(self.conflicts[pair][0]), pair))
        instants = self.conflicts[a, b]
        breaks = np.flatnonzero(np.diff(instants) > 1)
        last = instants[breaks[0]] if len(breaks) else instants[-1]
        return ConflictInterval(a=a, b=b, first=float(instants[0]), last=float(last))

    def common_arms(self) -> list[int]:
        """The arms that are in every conflicting pair: two of them where there is one pair only, often none."""
        pairs = list(self.conflicts)
        return [arm for arm in sorted(set(pairs[0])) if all(arm in pair for pair in pairs)] if pairs else []

    def child(self, branch: Branch) -> Node:
        """A copy that has the constraints of a branch, and whose arm is still to be replanned."""
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
        )

    def replaced(self, arms: PlanningContext, arm: int, path: Path) -> tuple[tuple[Path, ...], PairConflicts]:
        """The paths with another one for `arm`, and their conflicts: only the pairs of that arm are looked at again."""
        paths = (*self.paths[:arm], path, *self.paths[arm + 1 :])
        kept = {pair: instants for pair, instants in self.conflicts.items() if arm not in pair}
        return paths, {**kept, **arms.conflicts(paths, arms.pairs(arm))}
