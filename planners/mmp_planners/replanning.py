"""One arm after the other planned anew among all others, for what shortcuts cannot find: another way round.

A large-neighbourhood search (Shaw 1998; for many robots MAPF-LNS, Li et al., IJCAI 2021), the neighbourhood one arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env.plan import Plan
from mmp_planners.arms import Arms
from mmp_planners.shortcutting import on_grid

WORTH_RAD = 0.1
"""An arm whose path is not longer than the straight line by more than this is left alone."""


@dataclass(frozen=True, kw_only=True)
class Replanning:
    """The arms with the longest detours first; a new path is kept if it is shorter. The low level is that of `Arms`."""

    def __call__(self, arms: Arms, plan: Plan, seed: int) -> tuple[Plan, int]:
        """The plan with shorter paths, its certificate still to come, and how many arms were asked."""
        problem = plan.problem
        paths = [arms.path(arm, q) for arm, q in enumerate(on_grid(plan, arms.dt))]
        straight = [float(np.abs(problem.goal[name] - problem.start[name]).sum()) for name in arms.names]
        detours = [path.length - length for path, length in zip(paths, straight, strict=True)]
        calls = replaced = 0
        for arm in sorted(range(len(paths)), key=lambda arm: (-detours[arm], arm)):
            if detours[arm] < WORTH_RAD or arms.clock.expired:
                break
            calls += 1
            others = [path for other, path in enumerate(paths) if other != arm]
            sub_seed = int(np.random.SeedSequence((seed, arm)).generate_state(1, np.uint64)[0])
            path, _ = arms.low_level(arm, (), sub_seed, others=others)
            if path is not None and path.length < paths[arm].length:
                paths[arm] = path
                replaced += 1
        return (arms.plan(paths, {}, {}) if replaced else plan), calls
