"""Contacts, margins and tool axes that `planted_violations.py` plants; the native core shows that they are violations.

Each function that takes a kind of margin, `arms`, `obstacles` or `self`, plants violations of that margin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from attacked_plan import Document, Plant, Rng, any_arm, dense, is_retimed, meant_cell, rows_of

from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell
from mmp_env.model.keep import Upright

SURE_M, SURE_RAD = 1e-4, 1e-5
"""Least violation of a margin [m], and of the bound of a tool axis [rad]."""
FREE_M = 0.005
"""Least clearance [m] at the samples between which a contact is planted."""
BALL_M = 0.01
"""Radius of a planted ball [m]."""


def clearance(cell: Cell, rows: dict[str, np.ndarray], margin: str) -> float:
    """Returns the least clearance [m] of configurations for one kind of margin."""
    if margin == "arms":
        return float(replace(cell, obstacles=()).collision.clearance(rows).min())
    least = []
    for arm in cell.arms:
        alone = replace(cell, arms=(arm,), obstacles=cell.obstacles if margin == "obstacles" else ())
        q = rows[arm.name]
        by_row = alone.collision.static_clearance(arm.name, q) if margin == "self" else alone.collision.clearance(rows)
        least.append(float(by_row.min()))
    return min(least)


def least_clearance(given: Document, margin: str) -> float:
    """Returns the least clearance [m] of a plan, on the lines between its samples too, for one kind of margin."""
    return clearance(meant_cell(given), {name: dense(q) for name, q in rows_of(given).items()}, margin)


def is_too_close(given: Document, margin: str) -> bool:
    """Returns whether a plan surely breaks a margin."""
    return least_clearance(given, margin) < given["problem"]["margins"][margin] - SURE_M


def swing(margin: str, reach_rad: float) -> Plant:
    """Returns a violation: between two samples an arm swings slowly to a configuration, and back, and touches.

    Args:
        margin: kind of the margin.
        reach_rad: standard deviation of the distance that a joint swings.
    """

    def plant(given: Document, rng: Rng) -> bool:
        if is_retimed(given):
            return False
        rows, arm = rows_of(given), any_arm(given, rng)
        cell = meant_cell(given)
        robot, k = cell.arm(arm).robot, int(rng.integers(len(given["times"]) - 1))
        there = np.clip(rows[arm][k] + rng.normal(0, reach_rad, len(rows[arm][k])), robot.lower, robot.upper)
        state = {name: there[None] if name == arm else q[k : k + 1] for name, q in rows.items()}
        if clearance(cell, state, margin) < FREE_M:
            return False
        for name, q in rows.items():
            middle = there if name == arm else q[k]
            given["positions"][name] = np.insert(q, k + 1, [middle, q[k]], axis=0).tolist()
        times = np.array(given["times"])
        given["times"] = [*times[: k + 1], times[k] + 20, times[k] + 40, *(times[k + 1 :] + 40)]
        return is_too_close(given, margin)

    return plant


def raise_margin(margin: str) -> Plant:
    """Returns a violation: the problem states a margin that the plan does not keep."""

    def plant(given: Document, rng: Rng) -> bool:
        least = least_clearance(given, margin)
        given["problem"]["margins"][margin] = least + 2 * SURE_M
        if margin == "arms":
            given["problem"]["margin"] = least + 2 * SURE_M
        return least > 0

    return plant


def move_base(given: Document, rng: Rng) -> bool:
    """Moves the base of an arm towards another arm."""
    arm = given["problem"]["cell"]["arms"][int(rng.integers(len(given["problem"]["cell"]["arms"])))]
    arm["position"] = (np.array(arm["position"]) + np.append(rng.normal(0, 0.2, 2), 0)).tolist()
    try:
        return is_too_close(given, "arms")
    except MmpError:  # the bases overlap: no such cell
        return False


def add_obstacle(given: Document, rng: Rng) -> bool:
    """Puts a ball where the tool of an arm passes."""
    arm, rows = any_arm(given, rng), rows_of(given)
    tool = meant_cell(given).collision.tool_points(arm, rows[arm])[int(rng.integers(len(rows[arm])))]
    given["problem"]["cell"]["obstacles"].append(ball_at(tool))
    return is_too_close(given, "obstacles")


def add_moving_obstacle(given: Document, rng: Rng) -> bool:
    """Puts a ball in the cell whose speed lets it reach the tool of an arm that moves."""
    arm, rows = any_arm(given, rng), rows_of(given)
    k = int(rng.integers(1, len(rows[arm])))
    if (rows[arm][k] == rows[arm][k - 1]).all() or given["times"][k - 1] <= 0:
        return False
    cell = meant_cell(given)
    tool = cell.collision.tool_points(arm, rows[arm])[k - 1]
    away = rng.normal(size=3)
    away *= rng.uniform(2, 4) / np.linalg.norm(away)
    speed = np.linalg.norm(away) / given["times"][k - 1]
    given["problem"]["cell"]["obstacles"].append(ball_at(tool + away) | {"speed": speed})
    return True


def ball_at(position: np.ndarray) -> Document:
    """Returns a small ball as an obstacle of a document."""
    return {"name": "planted", "shape": "sphere", "position": position.tolist(), "yaw": 0.0, "radius": BALL_M}


def grow_held(margin: str) -> Plant:
    """Returns a violation: what an arm holds is larger, so that it touches."""

    def plant(given: Document, rng: Rng) -> bool:
        held = [arm for arm in given["problem"]["cell"]["arms"] if arm.get("held")]
        if not held:
            return False
        arm = held[int(rng.integers(len(held)))]
        arm["held"]["size"] = (np.array(arm["held"]["size"]) * rng.uniform(2, 6)).tolist()
        return is_too_close(given, margin)

    return plant


def tilt(given: Document, rng: Rng) -> bool:
    """States a bound for a tool axis that leaves it at a sample."""
    return _tilt(given, rng, between=False)


def tilt_between_samples(given: Document, rng: Rng) -> bool:
    """States a bound for a tool axis that leaves it between two samples and keeps it at all of them."""
    return _tilt(given, rng, between=True)


def _tilt(given: Document, rng: Rng, *, between: bool) -> bool:
    arm, axis = any_arm(given, rng), rng.normal(size=3)
    cell, q = meant_cell(given), rows_of(given)[arm]
    keeping = replace(cell, keep={arm: Upright(axis=axis, within=np.pi / 2)}).collision
    at_samples, highest = keeping.tilt(arm, q).max(), keeping.tilt(arm, dense(q)).max()
    within = highest - SURE_RAD if between else at_samples - SURE_RAD
    if not 2 * SURE_RAD < within < np.pi / 2 or (between and at_samples > within - SURE_RAD):
        return False
    given["problem"]["keep"] = {arm: {"upright": {"axis": axis.tolist(), "within": float(within)}}}
    return True
