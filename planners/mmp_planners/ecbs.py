"""ECBS: Barer, Sharon, Stern, Felner: Suboptimal variants of the conflict-based search algorithm for the multi-agent
pathfinding problem, SoCS 2014, section on enhanced CBS; here over a sampling single-arm planner.

Guarantee: w times the planner's own path lengths if `bound_met`. Not complete with the default constraint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mmp_planners.conflict_tree.selection import Focal
from mmp_planners.planner import About
from mmp_planners.tree_planner import OneKindPlanner, Parts, option


@dataclass(frozen=True, kw_only=True)
class Ecbs(OneKindPlanner):
    """ECBS: a focal list over the conflict tree, fewest conflicts first within w times the bound.

    Departure: in the paper the low level is a focal search as well, and its bound is f_min. Here only the high level is
    focal, and lb_i is the length of arm i's own path. So w bounds the cost relative to the planner's own paths. The
    bound is a true one if `cost_ratio`, relative to the straight lines, is at most w.
    """

    name: ClassVar[str] = "ecbs"
    about: ClassVar[About] = About(
        paper="Barer, Sharon, Stern, Felner: Suboptimal variants of the conflict-based search algorithm for the "
        "multi-agent pathfinding problem, SoCS 2014",
        url="https://doi.org/10.1609/socs.v5i1.18315",
        guarantee="w times the planner's own path lengths where `bound_met`; not complete with the default constraint",
    )

    w: float = option(1.5, "suboptimality factor of the focal list", least=1.0)

    def parts(self, seed: int) -> Parts:
        return Parts(selection=Focal(w=self.w), branching=self.branching())
