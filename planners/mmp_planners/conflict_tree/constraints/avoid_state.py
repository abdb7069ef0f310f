"""`avoid-state`: the constraint of CBS-MP (Solis, Motes, Sandström, Amato: Representation-optimal multi-robot motion
planning using conflict-based search, IEEE Robotics and Automation Letters 6(3), 2021).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class AvoidState:
    """Forbids contact with the other arm's configuration at the conflict.

    The constraint holds from `pad` [s], in whole steps, before the first contact to a step and `pad` after the last. In
    later trees `pad` is longer, by the `pad_factor` of the conflict. If the other arm has reached its goal, the
    constraint holds for good. If the arm's own start touches that configuration, the constraint begins at the conflict:
    else an early conflict would leave both children without a solution.
    Not complete: the other arm need not be there in every solution.
    """

    pad: float = 0.25

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]:
        other = interval.other(arm)
        pad = round(interval.pad_factor * self.pad / context.dt)
        out = []
        for k in interval.instants(instant):
            q = paths[other].at(k)
            first, last = int(interval.first), math.ceil(interval.last)
            start = int(k) if context.start_touches(arm, other, q) else max(0, first - pad)
            end = core.FOREVER if k >= paths[other].last else last + 1 + pad
            out.append(core.Constraint.standing(context.core, other, q, start=start, end=end))
        return out

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str:
        other = context.names[interval.other(arm)]
        return f"{context.names[arm]} avoids {other} at {interval.first * context.dt:.1f} s"
