"""Conflict-based search (Sharon, Stern, Felner, Sturtevant 2015), over a sampling single-arm planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mmp_planners.conflict_tree.selection import BestFirst
from mmp_planners.conflict_tree.tree_planner import OneKindPlanner, Parts
from mmp_planners.planner import About


@dataclass(frozen=True, kw_only=True)
class Cbs(OneKindPlanner):
    """CBS: best first by cost, w = 1, with the same constraint kinds, low level and restarts as `ecbs`.

    Departure: the low level samples, so its paths are not the shortest, and a solution that is not yet proved to be the
    cheapest of the tree is waited upon for `patience` expansions only. `bound_met` says that no open node is cheaper.
    """

    name: ClassVar[str] = "cbs"
    about: ClassVar[About] = About(
        paper="Sharon, Stern, Felner, Sturtevant: Conflict-based search for optimal multi-agent pathfinding, "
        "Artificial Intelligence 219, 2015",
        url="https://doi.org/10.1016/j.artint.2014.11.006",
        guarantee="the cheapest of its own tree where `bound_met`; not complete with the default constraint",
    )

    def parts(self, seed: int) -> Parts:
        return Parts(selection=BestFirst(), branching=self.branching())
