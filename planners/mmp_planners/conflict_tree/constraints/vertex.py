"""`vertex`: the constraint of CBS on graphs (Sharon, Stern, Felner, Sturtevant: Conflict-based search for optimal
multi-agent pathfinding, Artificial Intelligence 219, 2015) and of APF-ECBS, with a radius.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class Vertex:
    """Forbids a ball about the arm's own configuration at the conflict: the paper's constraint, with a stated radius.

    max_j |q_j - q_c,j| <= r_c while |t - t_k| <= tau, with r_c = min(`radius` [rad], v_max t_k / 2) and tau = dt. A
    point in a continuous space has measure zero, hence the radius; it shrinks near the start so that a child stays
    solvable.
    Not complete: both arms may be within their balls without a contact; see `split`.
    """

    radius: float = 0.2

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]:
        out = []
        for k in interval.instants(instant):
            radius = min(self.radius, float(context.max_step[arm].max()) * k / 2)
            out.append(core.Constraint.ball(paths[arm].at(k), radius, max(0, math.ceil(k) - 1), interval.end(k)))
        return out

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str:
        return f"{context.names[arm]} leaves its configuration at {interval.first * context.dt:.1f} s"
