"""APF-ECBS: repulsive trajectory modification and conflict resolution (arXiv 2509.13882, 2025), Algorithm 1."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mmp_env.problem import Problem
from mmp_planners.events import Watcher, ignore
from mmp_planners.fast_track import NoFastTrack, RepulsiveFastTrack
from mmp_planners.planner import PlanResult
from mmp_planners.selection import Focal
from mmp_planners.tree_planner import RepulsionOptions, option, plan_with_tree


@dataclass(frozen=True, kw_only=True)
class ApfEcbsNf(RepulsionOptions):
    """APF-ECBS without the fast track: ECBS that pushes every replanned path away from the other arms."""

    w: float = option(1.5, "suboptimality factor of the focal list", positive=True)

    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        return plan_with_tree(
            "apf-ecbs-nf",
            self,
            problem,
            selection=Focal(w=self.w),
            modification=self.modification(),
            fast_track=NoFastTrack(),
            seed=seed,
            time_limit=time_limit,
            watch=watch,
        )


@dataclass(frozen=True, kw_only=True)
class ApfEcbs(RepulsionOptions):
    """APF-ECBS: repulsion after every replanning, and the fast track when one arm is in every conflict."""

    w: float = option(1.5, "suboptimality factor of the focal list", positive=True)
    fast_track: str = option(
        "sound", "sound: the node stays branchable; literal: it takes the modified path", choices=("sound", "literal")
    )

    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        repulsion = self.modification()
        return plan_with_tree(
            "apf-ecbs",
            self,
            problem,
            selection=Focal(w=self.w),
            modification=repulsion,
            fast_track=RepulsiveFastTrack(modification=repulsion, literal=self.fast_track == "literal"),
            seed=seed,
            time_limit=time_limit,
            watch=watch,
        )
