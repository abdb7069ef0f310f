"""`avoid-path`: the constraint of continuous-time CBS over safe intervals, SI-CCBS (Andreychuk, Yakovlev, Surynek,
Atzmon, Stern: Multi-agent pathfinding with continuous time, Artificial Intelligence 305, 2022).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval, without_start_violations
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class AvoidPath:
    """Forbids contact with the other arm as it moves along its path while the conflict lasts.

    The constraint holds from the last step before the conflict to the first step after it. If the other arm has
    reached its goal by then, the constraint holds for good. Parts that the arm's own start violates before the
    conflict begins are left out.
    Not complete: the other arm need not move like that in every solution.
    """

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]:
        path = paths[interval.other(arm)]
        start = max(0, math.ceil(interval.first) - 1)
        end = core.FOREVER if interval.last >= path.last else int(interval.last) + 1
        return without_start_violations(context, arm, core.Constraint.moving(path.motion, start, end), interval)

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str:
        other = context.names[interval.other(arm)]
        when = f"{interval.first * context.dt:.1f} to {interval.last * context.dt:.1f} s"
        return f"{context.names[arm]} avoids the path of {other} from {when}"
