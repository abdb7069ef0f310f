"""Large-neighbourhood search: replans a few arms among the fixed others, where shortcuts find no shorter path.

A large-neighbourhood search (Shaw 1998; for many robots MAPF-LNS, Li et al., IJCAI 2021). The neighbourhood is one arm,
or one more that makes room for it; both may end at another candidate (`native/improve/replanner.hpp`). RRT in space and
time finds the paths; it searches only where they can still become shorter (`native/single_arm/informed_rrt.hpp`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_planners.options import GRID_STEP_S
from mmp_planners.portfolio.shortcutting import on_grid, retime_to_velocity_limits, step_of_grid


@dataclass(frozen=True, kw_only=True)
class LargeNeighbourhoodSearch:
    """Makes `attempts` to give arms shorter paths on a grid of `dt` [s]. The same seed gives the same plan."""

    attempts: int
    dt: float = GRID_STEP_S

    def __call__(self, plan: Plan, seed: int, clock: core.Clock) -> tuple[Plan, int]:
        """Returns the shorter plan, not certified yet, and the number of successful attempts."""
        problem, dt = plan.problem, step_of_grid(plan, self.dt)
        rows, kept = core.replan(
            problem.cell.collision.core,
            on_grid(plan, dt),
            [problem.max_velocity[name] * dt for name in problem.cell.arm_names],
            goals=[np.ascontiguousarray(problem.goals[name]) for name in problem.cell.arm_names],
            levels=problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
            attempts=self.attempts,
            seed=seed,
            clock=clock,
        )
        return (retime_to_velocity_limits(problem, rows) if kept else plan), kept
