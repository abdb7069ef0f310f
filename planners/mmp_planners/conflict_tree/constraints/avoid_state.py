"""`avoid-state`: the constraint of CBS-MP (Solis, Motes, Sandström, Amato 2021)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import _core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class AvoidState:
    """Do not touch the other arm as it stands at the conflict, from `pad` [s] before it begins to `pad` after it ends.

    The window is in whole steps, `pad` rounded to them.
    Where the other arm is at its goal already it stays there, and so does the constraint. Where the arm's own start
    touches that state the window opens at the state's instant, not before: else a conflict in the first moments would
    leave both children without a solution.
    Not complete: the other arm need not stand there in every solution.
    """

    pad: float = 0.25

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]:
        other = meeting.other(arm)
        pad = round(self.pad / arms.dt)
        out = []
        for k in meeting.instants(instant):
            q = paths[other].at(k)
            first, last = int(meeting.first), math.ceil(meeting.last)
            start = int(k) if arms.start_touches(arm, other, q) else max(0, first - pad)
            end = _core.FOREVER if k >= paths[other].last else last + 1 + pad
            out.append(_core.Constraint.standing(arms.core, other, q, 0.0, start, end))
        return out

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str:
        other = arms.names[meeting.other(arm)]
        return f"{arms.names[arm]} avoids {other} at {meeting.first * arms.dt:.1f} s"
