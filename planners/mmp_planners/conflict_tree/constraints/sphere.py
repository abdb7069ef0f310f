"""`sphere`: keep out of the place where the arms touch (Shaoul et al. 2024, arXiv 2405.01772)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mmp_env import _core
from mmp_planners.conflict_tree.constraints.kind import ConflictInterval, may_start
from mmp_planners.conflict_tree.contact import contacts
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """No moving link but the first touches a sphere of `radius` [m] at the point of contact, one step each way.

    The first link can hardly leave; it is included where it is itself in contact. Where the arm's own start touches the
    sphere the window opens with the conflict, not before.
    Not complete: in a solution both arms may reach into the sphere without a contact.
    """

    radius: float = 0.1

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]:
        out = []
        a, b, instants = meeting.a, meeting.b, tuple(meeting.instants(instant))
        for contact in contacts(arms, a, paths[a], b, paths[b], instants):
            k, link = contact.instant, contact.links[0 if arm == a else 1]
            place = contact.point, self.radius, min(link, 2)
            constraint = _core.Constraint.sphere(*place, max(0, math.ceil(k) - 1), int(k) + 1)
            if not may_start(arms, arm, constraint):
                constraint = _core.Constraint.sphere(*place, int(k), int(k) + 1)
            out.append(constraint)
        return out

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str:
        when = f"{meeting.first * arms.dt:.1f} s"
        return f"{arms.names[arm]} keeps {self.radius:g} m from where it met {arms.names[meeting.other(arm)]} at {when}"
