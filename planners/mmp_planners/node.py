"""Nodes of the conflict tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env import _core
from mmp_planners.arms import Arms, PairConflicts, Path
from mmp_planners.constraints import Meeting


@dataclass(kw_only=True, eq=False)
class Node:
    """N: one path T_i per arm, the constraints that they keep, and the conflicts that are left.

    `bounds` holds each arm's lb_i [rad]: the length of its planned path before repulsion.
    """

    id: int
    parent: int | None
    paths: tuple[Path, ...]
    constraints: tuple[tuple[_core.Constraint, ...], ...]
    bounds: tuple[float, ...]
    conflicts: PairConflicts
    fast_tracked: bool = False

    @property
    def cost(self) -> float:
        """sum_i |T_i|_1 [rad]."""
        return sum(path.length for path in self.paths)

    @property
    def lower_bound(self) -> float:
        return sum(self.bounds)

    @property
    def conflict_count(self) -> int:
        """Conflicts as triples (i, j, k), k over whole steps."""
        return sum(len(instants) for instants in self.conflicts.values())

    def first_conflict(self) -> Meeting:
        """The earliest conflict (then the first pair): its unbroken run of instants."""
        a, b = min(self.conflicts, key=lambda pair: (float(self.conflicts[pair][0]), pair))
        instants = self.conflicts[a, b]
        breaks = np.flatnonzero(np.diff(instants) > 1)
        last = instants[breaks[0]] if len(breaks) else instants[-1]
        return Meeting(a=a, b=b, first=float(instants[0]), last=float(last))

    def common_arms(self) -> list[int]:
        """The arms that are in every conflicting pair: two of them where there is one pair only, often none."""
        pairs = list(self.conflicts)
        return [arm for arm in sorted(set(pairs[0])) if all(arm in pair for pair in pairs)] if pairs else []

    def replaced(self, arms: Arms, arm: int, path: Path) -> tuple[tuple[Path, ...], PairConflicts]:
        """The paths with another one for `arm`, and their conflicts: only the pairs of that arm are looked at again."""
        paths = (*self.paths[:arm], path, *self.paths[arm + 1 :])
        kept = {pair: instants for pair, instants in self.conflicts.items() if arm not in pair}
        return paths, {**kept, **arms.conflicts(paths, arms.pairs(arm))}
