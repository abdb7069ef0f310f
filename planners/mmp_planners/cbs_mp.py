"""CBS-MP (Solis, Motes, Sandström, Amato 2021): conflict-based search for robots with many joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mmp_planners.conflict_tree.constraints import AvoidState, EitherArm
from mmp_planners.conflict_tree.selection import BestFirst
from mmp_planners.conflict_tree.tree_planner import Parts, TreePlanner
from mmp_planners.planner import About


@dataclass(frozen=True, kw_only=True)
class CbsMp(TreePlanner):
    """CBS-MP: best first by cost, and each branch avoids the state in which the other arm was met.

    Departure: its low level is a search on one roadmap an arm, ours samples anew for each node; with that it is `cbs`
    with its default constraint.
    """

    name: ClassVar[str] = "cbs-mp"
    about: ClassVar[About] = About(
        paper="Solis, Motes, Sandström, Amato: Representation-optimal multi-robot motion planning using conflict-based "
        "search, IEEE Robotics and Automation Letters 6(3), 2021",
        url="https://doi.org/10.1109/LRA.2021.3068910",
        guarantee="the cheapest of its own tree where `bound_met`; not complete",
    )

    def parts(self, seed: int) -> Parts:
        return Parts(selection=BestFirst(), branching=EitherArm(kind=AvoidState(pad=self.pad)))
