"""Draws instances whose tools are upright at start and goal, and plants violations into their plans."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.files.plan_file import plan_to_dict
from mmp_env.files.writing import plain
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.keep import Upright
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.problems.making import make_problem

CLEARANCE_M = 0.01
"""Least clearance [m] of start and goal."""
WALKS, STEP_RAD = 6, 0.2
"""Number of walks from a start to its goal, and largest move of a joint [rad] in a step of a walk."""
KINDS = ("waypoint", "bound", "excursion")
"""Kinds of planted violations: a waypoint is tilted; the bound is tightened, or so little that the plan breaks it only
between its samples."""


def upright_problem(cell: Cell, seed: int, bound: Upright) -> Problem:
    """Returns a problem in which every arm keeps the bound: a random start, and the end of a random walk within it."""
    rng = np.random.default_rng(seed)
    kept = replace(cell, keep=dict.fromkeys(cell.arm_names, bound))
    start = _free_state(kept, lambda arm: _projected(kept, arm, _anywhere(arm, rng)))
    goal = _free_state(kept, lambda arm: _walked(kept, arm, start[arm.name], rng))
    return make_problem(kept, start, goal, name=f"upright/{seed}")


def _anywhere(arm: Arm, rng: np.random.Generator) -> Float[np.ndarray, "dof"]:
    return rng.uniform(np.maximum(arm.robot.lower, -np.pi), np.minimum(arm.robot.upper, np.pi))


def _projected(cell: Cell, arm: Arm, q: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "dof"] | None:
    """Returns the configuration moved inside the bound, or None."""
    (moved,), (found,) = cell.collision.project_upright(arm.name, q[None])
    return moved if found else None


def _free_state(cell: Cell, draw: Callable[[Arm], np.ndarray | None]) -> dict[str, Float[np.ndarray, "dof"]]:
    """Returns arm name -> [dof] [rad], drawn until it is free."""
    model = cell.collision
    while True:
        state: dict[str, np.ndarray] = {}
        for arm in cell.arms:
            while arm.name not in state:
                q = draw(arm)
                if q is not None and model.is_free(arm.name, q[None], margin=CLEARANCE_M)[0]:
                    state[arm.name] = q
        if model.clearance({name: q[None] for name, q in state.items()})[0] > CLEARANCE_M:
            return state


def _walked(
    cell: Cell, arm: Arm, q: Float[np.ndarray, "dof"], rng: np.random.Generator
) -> Float[np.ndarray, "dof"] | None:
    """Returns the end of walks towards random configurations, each as far as the arm alone is free."""
    for _ in range(WALKS):
        target = _anywhere(arm, rng)
        while (far := np.abs(target - q).max()) > STEP_RAD:
            ahead = _projected(cell, arm, q + STEP_RAD / far * (target - q))
            if ahead is None or np.abs(target - ahead).max() > far - STEP_RAD / 10:
                break
            if not cell.collision.edge_free(arm.name, q[None], ahead[None])[0]:
                break
            q = ahead
    return q


def with_violation(plan: Plan, kind: str, rng: np.random.Generator) -> dict[str, Any] | None:
    """Returns the content of a plan file that breaks the bound of one arm; None if the plan has no such place."""
    data = plain(plan_to_dict(plan))
    moving = [name for name, q in plan.positions.items() if np.ptp(q, axis=0).max() > 1e-3]
    if not moving or len(plan.times) < 4:
        return None
    name = moving[rng.integers(len(moving))]
    model, q, within = plan.problem.cell.collision, plan.positions[name], plan.problem.keep[name].within
    k = int(rng.integers(1, len(q) - 2))
    if kind == "bound":
        tightest = float(model.tilt(name, q).max()) * rng.uniform(0.7, 0.9999)
        data["problem"]["keep"][name]["upright"]["within"] = tightest
    elif kind == "waypoint":
        data["positions"][name][k] = _tilted(plan, name, q[k], within, rng).tolist()
    else:
        at_samples = float(model.tilt(name, q).max())
        highest = float(model.tilt(name, plan.sampled(plan.finer_times(1e-3))[name]).max())
        if highest < 1.001 * at_samples:
            return None
        tightest = at_samples + rng.uniform(0.1, 0.9) * (highest - at_samples)
        data["problem"]["keep"][name]["upright"]["within"] = tightest
    return data


def _tilted(
    plan: Plan, name: str, q: Float[np.ndarray, "dof"], within: float, rng: np.random.Generator
) -> Float[np.ndarray, "dof"]:
    """Returns a configuration nearby whose tool axis is beyond its bound by 0.1 to 5 percent."""
    model, beyond = plan.problem.cell.collision, within * rng.uniform(1.001, 1.05)
    while True:
        way = rng.normal(size=len(q))
        rows = q + np.linspace(0, 2, 20001)[:, None] * way / np.linalg.norm(way)
        outside = model.tilt(name, rows) > beyond
        if outside.any():
            return rows[int(np.argmax(outside))]
