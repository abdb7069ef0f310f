"""`priority` and `priority-path`: the other arm goes first (Shaoul et al. 2024, arXiv 2405.01772)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import _core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval, without_early
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class StepPriority:
    """Do not touch the other arm as it moves on its path about the instant of the conflict, one step each way.

    The path is that of the node that is branched; what the other arm does in later nodes does not change it.
    Not complete: the other arm need not move like that in every solution.
    """

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]:
        motion = paths[meeting.other(arm)].motion
        parts = []
        for k in meeting.instants(instant):
            parts += _core.Constraint.moving(motion, max(0, math.ceil(k) - 1), int(k) + 1)
        return without_early(arms, arm, parts, meeting)

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str:
        return f"{arms.names[arm]} lets {arms.names[meeting.other(arm)]} pass at {meeting.first * arms.dt:.1f} s"


@dataclass(frozen=True, kw_only=True)
class PathPriority:
    """Do not touch the other arm anywhere along its path, nor where that path ends.

    The path is that of the node that is branched; what the other arm does in later nodes does not change it. A part of
    it is left out where the arm's own start would break it before the conflict begins.
    Not complete: the other arm need not move like that in every solution.
    """

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]:
        motion = paths[meeting.other(arm)].motion
        return without_early(arms, arm, _core.Constraint.moving(motion, 0, _core.FOREVER), meeting)

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str:
        return f"{arms.names[arm]} avoids all of the way of {arms.names[meeting.other(arm)]}"
