"""CBS-MP: Solis, Motes, Sandström, Amato: Representation-optimal multi-robot motion planning using conflict-based
search, IEEE Robotics and Automation Letters 6(3), 2021, Algorithm 1.

Guarantee: the cheapest solution of its own tree if `bound_met`. Not complete.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mmp_planners.conflict_tree.constraints import AvoidState, EitherArm
from mmp_planners.conflict_tree.selection import BestFirst
from mmp_planners.planner import About
from mmp_planners.tree_planner import Parts, TreePlanner


@dataclass(frozen=True, kw_only=True)
class CbsMp(TreePlanner):
    """CBS-MP: best first by cost; each branch avoids the other arm's configuration at the conflict.

    Departure: its low level searches one roadmap per arm, ours samples new paths for each node. So it is `cbs` with the
    default constraint.
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
