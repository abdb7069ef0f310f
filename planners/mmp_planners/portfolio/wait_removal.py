"""Wait removal: every arm moves as soon as the arms that pass before it let it.

The paths stay, and so does the order in which the arms pass, so the cost is the same and the makespan shorter: this is
the temporal plan graph (Hoenig et al.: Multi-agent path finding with kinematic constraints, ICAPS 2016) of the volumes
that the arms sweep (`native/improve/wait_removal.hpp`).
"""

from __future__ import annotations

from typing import Any

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_planners.options import option
from mmp_planners.portfolio.shortcutting import retime_to_velocity_limits

WAITS = ("removed", "kept")


def waits_option() -> Any:
    """Returns the field of the option that planners with wait removal have."""
    return option("removed", "waits that the order of the arms does not need", choices=WAITS)


def without_waits(plan: Plan, clock: core.Clock) -> Plan | None:
    """Returns the plan without the waits that the order of its arms does not need, not certified yet.

    Args:
        plan: a plan without contact.
        clock: deadline.

    Returns:
        A plan with the same paths, or None when the clock ends.
    """
    problem, names = plan.problem, plan.problem.cell.arm_names
    rows = core.remove_waits(
        problem.cell.collision.core,
        [plan.positions[name] for name in names],
        [problem.max_velocity[name] for name in names],
        distance=problem.levels(PLAN_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof,
        clock=clock,
    )
    return None if rows is None else retime_to_velocity_limits(problem, rows)
