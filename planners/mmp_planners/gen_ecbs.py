"""Gen-ECBS: Shaoul, Veerapaneni, Likhachev, Li: Unconstraining multi-robot manipulation: enabling arbitrary
constraints in ECBS with bounded sub-optimality, SoCS 2024 (arXiv 2405.01772), Algorithm 1.

Guarantee: w times the planner's own path lengths if `bound_met`. The branching loses no solution while `split` is among
the kinds; the sampling low level and restarts may.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mmp_planners.conflict_tree.bandit import DynamicThompsonSampling
from mmp_planners.conflict_tree.constraints import EveryKind
from mmp_planners.conflict_tree.constraints.named import constraint_kinds
from mmp_planners.conflict_tree.expansion import LazyExpansion
from mmp_planners.conflict_tree.selection import FocalPerKind
from mmp_planners.planner import About
from mmp_planners.tree_planner import Parts, RepulsionOption, TreePlanner, option


@dataclass(frozen=True, kw_only=True)
class GenEcbs(RepulsionOption, TreePlanner):
    """Gen-ECBS: branches of every constraint kind, a focal list for each kind, and a bandit that picks the list.

    Children are replanned when they are first selected. LB is the least bound of all leaves. One kind is complete, so
    solutions that the other kinds cut off stay reachable.
    Departure: bounds are as in `ecbs`, the lengths of the planner's own paths.
    """

    name: ClassVar[str] = "gen-ecbs"
    about: ClassVar[About] = About(
        paper="Shaoul, Veerapaneni, Likhachev, Li: Unconstraining multi-robot manipulation: enabling arbitrary "
        "constraints in ECBS with bounded sub-optimality, SoCS 2024",
        url="https://arxiv.org/abs/2405.01772",
        guarantee="w times the planner's own path lengths where `bound_met`; the branching loses no solution while "
        "`split` is among the kinds, the sampling low level and restarts may",
    )

    w: float = option(1.5, "suboptimality factor of the focal lists", least=1.0)
    kinds: str = option(
        "split+avoid-state+sphere-0.05+sphere-0.1+sphere-0.2+priority",
        "constraint kinds, joined by +; sphere-0.1 has a radius of 0.1 m, vertex-0.2 a radius of 0.2 rad",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        self.branching()

    def branching(self) -> EveryKind:
        """Returns the constraint kinds that `kinds` names. Raises `MmpError` if a kind does not exist."""
        return EveryKind(kinds=constraint_kinds(self.kinds, pad=self.pad))

    def parts(self, seed: int) -> Parts:
        branching = self.branching()
        bandit = DynamicThompsonSampling(len(branching.kinds) + 1, np.random.default_rng(seed))
        selection = FocalPerKind(w=self.w, bandit=bandit)
        return self.repelled(Parts(selection=selection, branching=branching, expansion=LazyExpansion()))
