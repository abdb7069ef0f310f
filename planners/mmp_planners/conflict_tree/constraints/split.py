"""`split`: the only kind whose two branches lose no solution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import core
from mmp_planners.conflict_tree.constraints.kind import Branch, ConflictInterval
from mmp_planners.planning_context import Contact, Path, PlanningContext

LEAST_DEPTH_M = 1e-5
"""Largest error of a distance in single precision [m]. A shallower conflict may be forbidden to its full depth."""


@dataclass(frozen=True, kw_only=True)
class Split:
    """At one instant t_k: arm j stays out of a ball B about q_j, or arm i keeps clear of what all of B shares.

    Let L [m/rad] bound how far any sphere centre of arm j moves when no joint moves more than one rad. Every
    configuration within r of q_j holds each sphere of arm j at q_j made smaller by L r: that is the core of B. At the
    conflict arm i is nearer to arm j than the margin, by the depth delta = margin - gap; with L r = `share` delta,
    0 < `share` < 1, it is nearer than the margin to the core too, so that each branch forbids its side of the conflict.
    Complete: in a solution arm j is outside B at t_k, or inside; then its spheres hold the core, and arm i, which keeps
    the margin from them, keeps it from the core. t_k is the deepest instant of the conflict and gives the largest ball,
    about 0.02 rad. So small a ball makes completeness slow. For a conflict that lasts, t_k is the end of time: the
    branches forbid goals, and nothing on the way there. The margin here is the one between arms plus the planning
    slack: planners take anything closer as a conflict.
    """

    share: float = 0.5

    @property
    def complete(self) -> bool:
        return True

    def branches(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]:
        contact = deepest(context, paths, interval)
        bounds = {arm: context.lipschitz(arm) for arm in (interval.a, interval.b)}
        j = min(bounds, key=lambda arm: (bounds[arm], -arm))
        i = interval.other(j)
        q, k = paths[j].at(contact.instant), core.FOREVER if interval.lasting else contact.instant
        depth = max(context.conflict_distance - contact.gap, 0.0)
        shrink = min(self.share * max(depth, LEAST_DEPTH_M), depth)
        at = f"{contact.instant * context.dt:.2f} s"
        out = Branch(
            arm=j,
            constraints=(core.Constraint.ball(q, shrink / bounds[j], k, k),),
            description=f"{context.names[j]} leaves its configuration at {at}",
        )
        off = Branch(
            arm=i,
            constraints=(core.Constraint.standing(context.core, j, q, shrink=shrink, start=k, end=k),),
            description=f"{context.names[i]} leaves room for {context.names[j]} at {at}",
        )
        return (out, off)


def deepest(context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval) -> Contact:
    """Returns the contact at the instant at which the arms are nearest; at the end, if the conflict lasts."""
    steps = range(math.ceil(interval.first), int(interval.last) + 1)
    a, b, instants = interval.a, interval.b, sorted({interval.first, interval.last, *map(float, steps)})
    if interval.lasting:
        instants = [interval.last]
    return min(context.contacts(a, paths[a], b, paths[b], tuple(instants)), key=lambda contact: contact.gap)
