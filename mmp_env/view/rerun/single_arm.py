"""The search tree of one arm (SI-RRT*) on the timeline `plan time`: a vertex appears at its arrival time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env import core
from mmp_env.errors import MmpError
from mmp_env.model.collision import PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.blueprint import of_single_arm
from mmp_env.view.rerun.colors import arm_colors
from mmp_env.view.rerun.conflict_intervals import configurations_at
from mmp_env.view.rerun.geoms import CellGeoms
from mmp_env.view.rerun.sdk import Recording, check, recording_target, require
from mmp_env.view.rerun.sphere_clouds import send_clouds

ROOT = "/single_arm"
TREE, SPHERES, PATH = f"{ROOT}/tree", f"{ROOT}/spheres", f"{ROOT}/path"
ITERATIONS = 400
"""Default steering distance [rad] of the planners, and number of iterations, which continue after the first path."""
_EDGE_POINTS = 5
_MOST_STEPS = 100_000
_EARLY, _LATE = np.array([253, 174, 60]), np.array([94, 30, 120])


@dataclass(frozen=True, kw_only=True, eq=False)
class GrownTree:
    """A search tree: configuration, arrival step and parent (-1 for none) of each vertex, and the path or None."""

    q: Float[np.ndarray, "v dof"]
    arrivals: Int[np.ndarray, "v"]
    parents: Int[np.ndarray, "v"]
    path: Float[np.ndarray, "k dof"] | None


def record_single_arm(
    plan: Plan, arm: str, to: str | PathLike[str], *, seed: int = 0, iterations: int = ITERATIONS, dt_s: float = 0.1
) -> GrownTree:
    """Searches a path for one arm among the others as they move in a plan, and records the search tree.

    Args:
        plan: the plan; the other arms move as in it.
        arm: name of the arm.
        to: a file `*.rrd`, or `spawn` to open the viewer.
        seed: seed of the search.
        iterations: number of iterations.
        dt_s: time step [s].

    Returns:
        The search tree.

    Raises:
        MmpError: as `RerunWatcher`, for an unknown arm, and for a time step that is not allowed.
    """
    check(to)
    plan.check_complete()
    if not 0 < dt_s < np.inf:
        raise MmpError(f"dt_s is {dt_s}; it must be a positive number of seconds")
    problem = plan.problem
    steps = plan.makespan_s / dt_s
    if not steps <= _MOST_STEPS:
        raise MmpError(f"the plan takes {plan.makespan_s:.6g} s, more than {_MOST_STEPS} steps of {dt_s} s")
    times = np.arange(int(np.ceil(steps - 1e-9)) + 1) * dt_s
    moving = {name: q for name, q in plan.sampled(times).items() if name != arm}
    grown = grow_tree(problem, arm, moving, seed, iterations, dt_s)
    with recording_target(to) as place:
        name = f"{arm} of {problem.name or problem.cell.name}"
        recording = Recording(place, f"single-arm of {problem.cell.name}", name)
        recording.end(_write(recording.stream, problem, arm, moving, grown, dt_s))
    return grown


def grow_tree(
    problem: Problem, arm: str, others: Mapping[str, Float[np.ndarray, "k _"]], seed: int, iterations: int, dt_s: float
) -> GrownTree:
    """Returns the tree of a search among `others`, trajectories in steps of `dt_s` [s]."""
    model, number = problem.cell.collision, problem.cell.arm_index(arm)
    start, goals = (np.ascontiguousarray(ends, dtype=float) for ends in (problem.start[arm], problem.goals[arm]))
    single = core.SingleArm(
        model.core,
        number,
        start=start,
        goals=goals,
        max_step=problem.max_velocity[arm] * dt_s,
        levels=problem.levels(SEARCH_MARGIN_FACTOR, PLAN_MARGIN_FACTOR),
        seed=seed,
    )
    motions = [model.motion(name, q) for name, q in others.items()]
    q, links, path = core.search_tree(single, others=motions, seed=seed, clock=core.Clock(60.0), iterations=iterations)
    return GrownTree(q=q, arrivals=links[:, 0], parents=links[:, 1], path=path)


def _write(
    stream: Any,
    problem: Problem,
    arm: str,
    others: Mapping[str, Float[np.ndarray, "k _"]],
    grown: GrownTree,
    dt_s: float,
) -> Any:
    """Sends all data and returns the blueprint."""
    rerun, cell = require(), problem.cell
    geoms = CellGeoms(stream, cell)
    strips = edges(problem, arm, grown)
    last = max(int(grown.arrivals.max(initial=0)), 1)
    share = grown.arrivals / last
    colors = np.rint(_EARLY + share[:, None] * (_LATE - _EARLY)).astype(np.uint8)
    for step in np.unique(grown.arrivals).tolist():
        here = np.flatnonzero(grown.arrivals == step)
        stream.set_time(timelines.PLAN_TIME, duration=step * dt_s)
        stream.log(f"{TREE}/edges/{step}", rerun.LineStrips3D(strips[here], colors=colors[here], radii=0.002))
        stream.log(f"{TREE}/points/{step}", rerun.Points3D(strips[here, -1], colors=colors[here], radii=0.008))
    stream.reset_time()
    path = problem.start[arm][None] if grown.path is None else grown.path
    if grown.path is not None:
        look = rerun.LineStrips3D([cell.collision.tool_points(arm, path)], colors=[arm_colors(cell)[arm]], radii=0.006)
        stream.log(PATH, look, static=True)
    steps = np.arange(max(len(path), *(len(q) for q in others.values()), last + 1), dtype=float)
    q = {name: configurations_at(rows, steps) for name, rows in {arm: path, **others}.items()}
    send_clouds(stream, SPHERES, [timelines.seconds(steps * dt_s)], cell, q, problem.conflict_distances)
    return of_single_arm(arm, geoms.model, ROOT)


def edges(problem: Problem, arm: str, grown: GrownTree) -> Float[np.ndarray, "v p 3"]:
    """Returns the tool path from the parent to each vertex [m]; that of the start is a point."""
    before = grown.q[np.where(grown.parents < 0, np.arange(len(grown.q)), grown.parents)]
    along = np.linspace(0.0, 1.0, _EDGE_POINTS)[:, None]
    q = before[:, None] + along * (grown.q - before)[:, None]
    points = problem.cell.collision.tool_points(arm, q.reshape(-1, q.shape[2]))
    return points.reshape(len(grown.q), _EDGE_POINTS, 3)
