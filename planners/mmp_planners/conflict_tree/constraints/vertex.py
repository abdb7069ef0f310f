"""`vertex`: the constraint of CBS on graphs (Sharon et al. 2015), which is that of APF-ECBS too, with a radius."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import _core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class Vertex:
    """Keep out of a ball about the own configuration at the conflict: the paper's constraint, with a stated radius.

    max_j |q_j - q_c,j| <= r_c while |t - t_k| <= tau, with r_c = min(`radius` [rad], v_max t_k / 2) and tau = dt. A
    point in a continuous space has measure zero, hence the radius; it shrinks near the start so that a child stays
    solvable.
    Not complete: both arms may be within their balls without a contact; see `split`.
    """

    radius: float = 0.2

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]:
        out = []
        for k in meeting.instants(instant):
            radius = min(self.radius, float(arms.max_step[arm].max()) * k / 2)
            out.append(_core.Constraint.ball(paths[arm].at(k), radius, max(0, math.ceil(k) - 1), int(k) + 1))
        return out

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str:
        return f"{arms.names[arm]} leaves its place at {meeting.first * arms.dt:.1f} s"
