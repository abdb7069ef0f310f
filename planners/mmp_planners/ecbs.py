"""Enhanced conflict-based search (Barer, Sharon, Stern, Felner 2014), over a sampling single-arm planner."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mmp_env.problem import Problem
from mmp_planners.events import Watcher, ignore
from mmp_planners.fast_track import NoFastTrack
from mmp_planners.planner import PlanResult
from mmp_planners.repulsion import Unmodified
from mmp_planners.selection import Focal
from mmp_planners.tree_planner import TreeOptions, option, plan_with_tree


@dataclass(frozen=True, kw_only=True)
class Ecbs(TreeOptions):
    """ECBS: a focal list over the conflict tree, fewest conflicts first within w times the bound.

    Departure: in Barer's ECBS the low level is a focal search as well and its bound is f_min; with a sampling planner
    only the high level is focal and lb_i is the length of arm i's own path. So w is relative to the planner's own
    costs, unless `cost_ratio` (to the straight lines) is at most w: that is a true bound.
    """

    w: float = option(1.5, "suboptimality factor of the focal list", positive=True)

    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        return plan_with_tree(
            "ecbs",
            self,
            problem,
            selection=Focal(w=self.w),
            modification=Unmodified(),
            fast_track=NoFastTrack(),
            seed=seed,
            time_limit=time_limit,
            watch=watch,
        )
