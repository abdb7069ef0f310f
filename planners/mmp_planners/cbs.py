"""CBS: Sharon, Stern, Felner, Sturtevant: Conflict-based search for optimal multi-agent pathfinding,
Artificial Intelligence 219, 2015, Algorithm 1; here over a sampling single-arm planner.

Guarantee: the cheapest solution of its own tree if `bound_met`. Not complete with the default constraint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mmp_planners.conflict_tree.selection import BestFirst
from mmp_planners.planner import About
from mmp_planners.tree_planner import OneKindPlanner, Parts, RepulsionOption


@dataclass(frozen=True, kw_only=True)
class Cbs(RepulsionOption, OneKindPlanner):
    """CBS: best first by cost, w = 1, with the same constraint kinds, low level and restarts as `ecbs`.

    Departure: the low level samples, so its paths are not the shortest. After a solution the search goes on for
    `patience` expansions at most, even if it may not be the cheapest of the tree. `bound_met`: no open node is cheaper.
    """

    name: ClassVar[str] = "cbs"
    about: ClassVar[About] = About(
        paper="Sharon, Stern, Felner, Sturtevant: Conflict-based search for optimal multi-agent pathfinding, "
        "Artificial Intelligence 219, 2015",
        url="https://doi.org/10.1016/j.artint.2014.11.006",
        guarantee="the cheapest of its own tree where `bound_met`; not complete with the default constraint",
    )

    def parts(self, seed: int) -> Parts:
        return self.repelled(Parts(selection=BestFirst(), branching=self.branching()))
