"""`sphere`: the arm keeps out of a sphere at the contact (Shaoul, Veerapaneni, Likhachev, Li: Unconstraining
multi-robot manipulation, SoCS 2024, arXiv 2405.01772).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval, allows_start
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """Forbids the moving links a sphere of `radius` [m] at the contact, from one step before to one step after it.

    The first link can hardly leave the sphere, so it is included only if it is itself in contact. If the arm's own
    start touches the sphere, the constraint begins at the conflict.
    Not complete: in a solution both arms may reach into the sphere without contact.
    """

    radius: float = 0.1

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]:
        out = []
        a, b, instants = interval.a, interval.b, tuple(interval.instants(instant))
        for contact in context.contacts(a, paths[a], b, paths[b], instants):
            k, link = contact.instant, contact.links[0 if arm == a else 1]
            sphere = contact.point, self.radius, min(link, 2)
            constraint = core.Constraint.sphere(*sphere, max(0, math.ceil(k) - 1), interval.end(k))
            if not allows_start(context, arm, constraint):
                constraint = core.Constraint.sphere(*sphere, int(k), interval.end(k))
            out.append(constraint)
        return out

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str:
        when = f"{interval.first * context.dt:.1f} s"
        other = context.names[interval.other(arm)]
        return f"{context.names[arm]} keeps {self.radius:g} m from its contact with {other} at {when}"
