"""Joint positions and velocities of a plan relative to their limits."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.plan import Plan
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.colors import CONTACT, legible
from mmp_env.view.rerun.sdk import entity_part, require
from mmp_env.view.rerun.sphere_clouds import Configurations

JOINTS = "/plan/joints"
POSITION, VELOCITY = "position", "velocity"
_COLORS = [
    legible(color)
    for color in (
        (228, 26, 28),
        (55, 126, 184),
        (77, 175, 74),
        (152, 78, 163),
        (255, 127, 0),
        (166, 86, 40),
        (98, 98, 98),
    )
]


def send_joints(stream: Any, plan: Plan, times: Float[np.ndarray, "t"], q: Configurations) -> None:
    """Sends `<arm>/position` and `<arm>/velocity`, one line per joint, scaled so that the limits are 1 and -1."""
    rerun = require()
    ends = [timelines.seconds([0.0, plan.makespan_s])]
    for arm in plan.problem.cell.arms:
        shares = {
            POSITION: (times, position_shares(arm.robot.lower, arm.robot.upper, q[arm.name])),
            VELOCITY: velocity_shares(plan, arm.name),
        }
        look = rerun.SeriesLines(
            names=[f"joint {k + 1}" for k in range(arm.dof)], colors=[_COLORS[k % 7] for k in range(arm.dof)]
        )
        for what, (instants, share) in shares.items():
            path = f"{JOINTS}/{entity_part(arm.name)}/{what}"
            stream.log(path, look, static=True)
            columns = rerun.Scalars.columns(scalars=share.ravel()).partition([arm.dof] * len(share))
            stream.send_columns(path, [timelines.seconds(instants)], columns)
            limits = rerun.SeriesLines(names=["limit", "limit"], colors=[CONTACT] * 2, widths=[1.0] * 2)
            stream.log(f"{path}/limits", limits, static=True)
            lines = rerun.Scalars.columns(scalars=[1.0, -1.0, 1.0, -1.0]).partition([2, 2])
            stream.send_columns(f"{path}/limits", ends, lines)


def position_shares(
    lower: Float[np.ndarray, "dof"], upper: Float[np.ndarray, "dof"], q: Float[np.ndarray, "t dof"]
) -> Float[np.ndarray, "t dof"]:
    """Returns positions scaled so that the lower limit is -1 and the upper limit 1."""
    return (2 * q - lower - upper) / (upper - lower)


def velocity_shares(plan: Plan, arm: str) -> tuple[Float[np.ndarray, "t"], Float[np.ndarray, "t dof"]]:
    """Returns times [s] and velocities relative to the limits of the problem.

    For a plan without velocities these are those of its segments, with a row for the start and the end of each.
    """
    limit = plan.problem.max_velocity[arm]
    if plan.velocities is not None:
        return plan.times, plan.velocities[arm] / limit
    if len(plan.times) == 1:
        return plan.times, np.zeros((1, len(limit)))
    slopes = np.diff(plan.positions[arm], axis=0) / np.diff(plan.times)[:, None] / limit
    return np.repeat(plan.times, 2)[1:-1], np.repeat(slopes, 2, axis=0)
