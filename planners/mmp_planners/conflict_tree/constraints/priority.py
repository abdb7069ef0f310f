"""`priority` and `priority-path`: the other arm goes first (Shaoul, Veerapaneni, Likhachev, Li: Unconstraining
multi-robot manipulation, SoCS 2024, arXiv 2405.01772).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval, without_start_violations
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class StepPriority:
    """Forbids contact with the other arm as it moves on its path, from one step before the conflict to one step after.

    The path is that of the branched node. Later changes of the other arm's path do not change the constraint.
    Not complete: the other arm need not move like that in every solution.
    """

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]:
        motion = paths[interval.other(arm)].motion
        parts = []
        for k in interval.instants(instant):
            parts += core.Constraint.moving(motion, max(0, math.ceil(k) - 1), interval.end(k))
        return without_start_violations(context, arm, parts, interval)

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str:
        other = context.names[interval.other(arm)]
        return f"{context.names[arm]} lets {other} pass at {interval.first * context.dt:.1f} s"


@dataclass(frozen=True, kw_only=True)
class PathPriority:
    """Forbids contact with the other arm all along its path, and at its end for good.

    The path is that of the branched node. Later changes of the other arm's path do not change the constraint. Parts
    that the arm's own start violates before the conflict begins are left out.
    Not complete: the other arm need not move like that in every solution.
    """

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]:
        motion = paths[interval.other(arm)].motion
        return without_start_violations(context, arm, core.Constraint.moving(motion, 0, core.FOREVER), interval)

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str:
        return f"{context.names[arm]} avoids the whole path of {context.names[interval.other(arm)]}"
