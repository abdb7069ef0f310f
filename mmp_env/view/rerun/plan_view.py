"""A plan on the timeline `plan time`: the moving cell, sphere clouds, clearances, joints and motion states."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.plan import Plan
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.colors import CONTACT, arm_colors, curve_colors
from mmp_env.view.rerun.geoms import CellGeoms, joined
from mmp_env.view.rerun.joints import send_joints
from mmp_env.view.rerun.motion_states import send_motion_states
from mmp_env.view.rerun.sdk import entity_part, require
from mmp_env.view.rerun.sphere_clouds import Configurations, send_clouds

FRAMES_PER_S = 25
MOST_FRAMES = 1000
"""Largest number of frames; longer plans have fewer frames per second."""
PATHS, SPHERES, CLEARANCE = "/plan/paths", "/plan/spheres", "/plan/clearance"


def send_plan(stream: Any, plan: Plan, geoms: CellGeoms) -> None:
    """Sends everything that is shown of a plan."""
    cell = plan.problem.cell
    times = frame_times(plan)
    q = plan.sampled(times)
    index = [timelines.seconds(times)]
    geoms.send_poses(index, joined(cell, q))
    send_clouds(stream, SPHERES, index, cell, q, plan.problem.margins)
    send_paths(stream, PATHS, q, plan)
    _send_clearance(stream, index, plan, q)
    send_joints(stream, plan, times, q)
    send_motion_states(stream, plan)


def frame_times(plan: Plan) -> Float[np.ndarray, "t"]:
    """Returns the times of the frames [s], from the start to the end of the plan."""
    count = min(MOST_FRAMES, int(np.ceil(plan.makespan_s * FRAMES_PER_S)))
    return np.linspace(0.0, plan.makespan_s, max(count, 1) + 1)


def send_paths(stream: Any, root: str, q: Configurations, plan: Plan) -> None:
    """Logs the tool path of each arm, for all times."""
    rerun, cell = require(), plan.problem.cell
    for name, color in arm_colors(cell).items():
        strip = cell.collision.tool_points(name, q[name])
        stream.log(f"{root}/{entity_part(name)}", rerun.LineStrips3D([strip], colors=[color], radii=0.004), static=True)


def _send_clearance(stream: Any, index: list[Any], plan: Plan, q: Configurations) -> None:
    """Sends the clearance of each arm from the others [m], and the margin."""
    rerun, problem = require(), plan.problem
    names = problem.cell.arm_names
    nearest = {name: np.full(len(q[names[0]]), np.inf) for name in names}
    for k, a in enumerate(names):
        for b in names[k + 1 :]:
            gap = problem.cell.collision.pair_clearance(a, q[a], b, q[b])
            nearest[a], nearest[b] = np.minimum(nearest[a], gap), np.minimum(nearest[b], gap)
    if len(names) > 1:
        for name, color in curve_colors(problem.cell).items():
            stream.log(
                f"{CLEARANCE}/{entity_part(name)}",
                rerun.SeriesLines(names=[name], colors=[color], widths=[1.5]),
                static=True,
            )
            stream.send_columns(f"{CLEARANCE}/{entity_part(name)}", index, rerun.Scalars.columns(scalars=nearest[name]))
    path = f"{CLEARANCE}/margin"
    stream.log(path, rerun.SeriesLines(names=["margin"], colors=[CONTACT], widths=[1.0]), static=True)
    ends = [timelines.seconds([0.0, plan.makespan_s])]
    stream.send_columns(path, ends, rerun.Scalars.columns(scalars=[problem.margin, problem.margin]))
