"""`avoid-path`: the constraint of continuous-time CBS (Andreychuk et al. 2022) over safe intervals, SI-CCBS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import _core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval, without_early
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class AvoidPath:
    """Do not touch the other arm as it moves along its path while the conflict lasts.

    From the last step before the conflict to the first one after it; where the other arm is at its goal by then it
    stays there, and so does the constraint. A part of it is left out where the arm's own start would break it before
    the conflict begins.
    Not complete: the other arm need not move like that in every solution.
    """

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]:
        path = paths[meeting.other(arm)]
        start = max(0, math.ceil(meeting.first) - 1)
        end = _core.FOREVER if meeting.last >= path.last else int(meeting.last) + 1
        return without_early(arms, arm, _core.Constraint.moving(path.motion, start, end), meeting)

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str:
        other = arms.names[meeting.other(arm)]
        when = f"{meeting.first * arms.dt:.1f} to {meeting.last * arms.dt:.1f} s"
        return f"{arms.names[arm]} avoids the way of {other} from {when}"
