"""xECBS: Shaoul, Mishani, Likhachev, Li: Accelerating search-based planning for multi-robot manipulation by leveraging
online-generated experiences, ICAPS 2024, Algorithm 1.

Guarantee: w times the planner's own path lengths if `bound_met`. Not complete with the default constraint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mmp_planners.conflict_tree.expansion import FromParent
from mmp_planners.conflict_tree.selection import Focal
from mmp_planners.planner import About
from mmp_planners.tree_planner import OneKindPlanner, Parts, RepulsionOption, option


@dataclass(frozen=True, kw_only=True)
class Xecbs(RepulsionOption, OneKindPlanner):
    """xECBS: ECBS whose low level begins with the parent's path, up to its first violation of a constraint.

    Departure: its low level searches a lattice that is seeded with the experience, ours grows a sampled tree. Bounds
    are as in `ecbs`.
    """

    name: ClassVar[str] = "xecbs"
    about: ClassVar[About] = About(
        paper="Shaoul, Mishani, Likhachev, Li: Accelerating search-based planning for multi-robot manipulation by "
        "leveraging online-generated experiences, ICAPS 2024",
        url="https://doi.org/10.1609/icaps.v34i1.31510",
        guarantee="w times the planner's own path lengths where `bound_met`; not complete with the default constraint",
    )

    w: float = option(1.5, "suboptimality factor of the focal list", least=1.0)

    def parts(self, seed: int) -> Parts:
        return self.repelled(Parts(selection=Focal(w=self.w), branching=self.branching(), experience=FromParent()))
