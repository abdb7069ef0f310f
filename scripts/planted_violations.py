"""Violations of every kind that `attack_checker.py` plants in valid plans."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell

Document = dict[str, Any]
Rng = np.random.Generator
Plant = Callable[[Document, Rng], bool]
SURE_M = 1e-4
"""Least violation of a margin [m]."""
DENSE = 400
"""Samples of a line."""


def rows_of(given: Document) -> dict[str, np.ndarray]:
    """Returns arm name -> configurations."""
    return {name: np.array(rows, dtype=float) for name, rows in given["positions"].items()}


def least_clearance(cell: Cell, rows: dict[str, np.ndarray]) -> float:
    """Returns the least clearance between arms, and to obstacles, on the lines between configurations, by samples."""
    fine = {name: dense(q) for name, q in rows.items()}
    return float(cell.collision.clearance(fine).min())


def dense(q: np.ndarray) -> np.ndarray:
    """Returns configurations on the lines between the given ones."""
    at = np.linspace(0, len(q) - 1, max(DENSE, 4 * len(q)))
    return np.column_stack([np.interp(at, np.arange(len(q)), column) for column in q.T])


def meant_cell(given: Document) -> Cell:
    """Returns the cell of a document."""
    from mmp_env.files.cell_file import cell_from_dict

    return cell_from_dict(given["problem"]["cell"], "plan", name="cell")


def any_arm(given: Document, rng: Rng) -> str:
    """Returns the name of an arm."""
    return str(rng.choice(sorted(given["positions"])))


def is_too_close(given: Document) -> bool:
    """Returns whether a plan is surely closer somewhere than its margin between arms."""
    return least_clearance(meant_cell(given), rows_of(given)) < given["problem"]["margins"]["arms"] - SURE_M


def swing(given: Document, rng: Rng) -> bool:
    """Lets an arm swing to another configuration and back between two samples, slowly, and touch something."""
    if "velocities" in given:
        return False
    rows, arm = rows_of(given), any_arm(given, rng)
    cell = meant_cell(given)
    robot, k = cell.arm(arm).robot, int(rng.integers(len(given["times"]) - 1))
    there = np.clip(rows[arm][k] + rng.normal(0, 0.6, len(rows[arm][k])), robot.lower, robot.upper)
    state = {name: there[None] if name == arm else q[k : k + 1] for name, q in rows.items()}
    if cell.collision.clearance(state)[0] < 0.005:
        return False  # the samples themselves shall be free
    for name, q in rows.items():
        middle = there if name == arm else q[k]
        given["positions"][name] = np.insert(q, k + 1, [middle, q[k]], axis=0).tolist()
    times = np.array(given["times"])
    given["times"] = [*times[: k + 1], times[k] + 20, times[k] + 40, *(times[k + 1 :] + 40)]
    return is_too_close(given)


def raise_margin(given: Document, rng: Rng) -> bool:
    """States a margin that the plan does not keep."""
    least = least_clearance(meant_cell(given), rows_of(given))
    given["problem"]["margins"]["arms"] = given["problem"]["margins"]["obstacles"] = least + 2 * SURE_M
    given["problem"]["margin"] = least + 2 * SURE_M
    return True


def move_base(given: Document, rng: Rng) -> bool:
    """Moves the base of an arm."""
    arm = given["problem"]["cell"]["arms"][int(rng.integers(len(given["problem"]["cell"]["arms"])))]
    arm["position"] = (np.array(arm["position"]) + np.append(rng.normal(0, 0.2, 2), 0)).tolist()
    try:
        return is_too_close(given)
    except MmpError:  # the bases overlap: no such cell
        return False


def add_obstacle(given: Document, rng: Rng) -> bool:
    """Puts a ball where the tool of an arm passes."""
    arm, rows = any_arm(given, rng), rows_of(given)
    tool = meant_cell(given).collision.tool_points(arm, rows[arm])[int(rng.integers(len(rows[arm])))]
    ball = {"name": "planted", "shape": "sphere", "position": tool.tolist(), "yaw": 0.0, "radius": 0.01}
    given["problem"]["cell"]["obstacles"].append(ball)
    return is_too_close(given)


def add_moving_obstacle(given: Document, rng: Rng) -> bool:
    """Puts a ball in the cell whose speed lets it reach the tool of an arm that moves."""
    arm, rows = any_arm(given, rng), rows_of(given)
    k = int(rng.integers(1, len(rows[arm])))
    if (rows[arm][k] == rows[arm][k - 1]).all():
        return False
    tool = meant_cell(given).collision.tool_points(arm, rows[arm])[k - 1]
    away = rng.normal(size=3)
    away *= rng.uniform(2, 4) / np.linalg.norm(away)
    if given["times"][k - 1] <= 0:
        return False
    ball = {"name": "planted", "shape": "sphere", "position": (tool + away).tolist(), "yaw": 0.0, "radius": 0.01}
    given["problem"]["cell"]["obstacles"].append(ball | {"speed": np.linalg.norm(away) / given["times"][k - 1]})
    return True


def grow_held(given: Document, rng: Rng) -> bool:
    """Makes what an arm holds larger, so that it touches another arm or an obstacle."""
    held = [arm for arm in given["problem"]["cell"]["arms"] if arm.get("held")]
    if not held:
        return False
    arm = held[int(rng.integers(len(held)))]
    arm["held"]["size"] = (np.array(arm["held"]["size"]) * rng.uniform(2, 6)).tolist()
    return is_too_close(given)


def leave_limits(given: Document, rng: Rng) -> bool:
    """Lets a joint leave its limits by 1e-6."""
    arm, rows = any_arm(given, rng), rows_of(given)
    robot, k = meant_cell(given).arm(arm).robot, int(rng.integers(len(rows[arm])))
    joint = int(rng.integers(robot.dof))
    given["positions"][arm] = rows[arm].tolist()
    given["positions"][arm][k][joint] = float(rng.choice([robot.lower[joint] - 1e-6, robot.upper[joint] + 1e-6]))
    return True


def lower_limit(key: str) -> Plant:
    """Returns a fault that states a limit just below the largest rate of a joint, by 3e-6 of it."""
    order = {"max_velocity": 1, "max_acceleration": 2, "max_jerk": 3}[key]

    def fault(given: Document, rng: Rng) -> bool:
        place = given["problem"]
        if place.get(key) is None or (order > 1 and "velocities" not in given):
            return False
        arm, times = any_arm(given, rng), np.array(given["times"])
        rates = rows_of(given)[arm]
        rest = np.pad(rates, ((order, order), (0, 0)), mode="edge") if order > 1 else rates
        step = np.diff(times)[:, None] if order == 1 else times[1] - times[0]
        largest = np.abs(np.diff(rest, n=order, axis=0) / step**order).max(axis=0)
        joint = int(np.argmax(largest))
        if largest[joint] < 1e-3:
            return False
        limits = dict(place[key]) if isinstance(place[key], dict) else {arm: [place[key]] * len(largest)}
        limits[arm] = [float(x) for x in limits[arm]]
        limits[arm][joint] = largest[joint] * (1 - 3e-6)
        place[key] = limits
        return True

    return fault


def change_end(which: str) -> Plant:
    """Returns a fault that states another start or goal than the plan has."""

    def fault(given: Document, rng: Rng) -> bool:
        arm = any_arm(given, rng)
        q = np.array(given["problem"][which][arm], dtype=float)
        q[int(rng.integers(len(q)))] += float(rng.choice([-1, 1])) * 3e-6
        given["problem"][which][arm] = q.tolist()
        return True

    return fault


def break_times(broken: Callable[[list[float], int], list[float]]) -> Plant:
    """Returns a fault that changes the times; `broken` gets them and a number from 1 on."""

    def fault(given: Document, rng: Rng) -> bool:
        times = [float(t) for t in given["times"]]
        given["times"] = broken(times, int(rng.integers(1, len(times))))
        return True

    return fault


def lose_arm(given: Document, rng: Rng) -> bool:
    """Leaves out an arm."""
    del given["positions"][any_arm(given, rng)]
    return True


def break_rows(broken: Callable[[list[list[float]], int], list[list[float]]]) -> Plant:
    """Returns a fault that changes the configurations of an arm; `broken` gets them and the number of one."""

    def fault(given: Document, rng: Rng) -> bool:
        arm = any_arm(given, rng)
        rows = [list(map(float, row)) for row in given["positions"][arm]]
        given["positions"][arm] = broken(rows, int(rng.integers(len(rows))))
        return True

    return fault


@dataclass(frozen=True)
class Kind:
    """Plants a violation in a document and returns whether it is one; `rules` are those of which it breaks one."""

    plant: Plant
    rules: frozenset[str]


def kind(plant: Plant, *rules: str) -> Kind:
    """Returns a kind of violation."""
    return Kind(plant, frozenset(rules))


KINDS = {
    "contact_between_samples": kind(swing, "arm-arm", "arm-obstacle"),
    "margin_raised": kind(raise_margin, "arm-arm", "arm-obstacle"),
    "base_moved": kind(move_base, "arm-arm", "arm-obstacle"),
    "obstacle_added": kind(add_obstacle, "arm-obstacle"),
    "moving_obstacle_added": kind(add_moving_obstacle, "arm-obstacle"),
    "held_object_grown": kind(grow_held, "arm-arm", "arm-obstacle"),
    "joint_limit_left": kind(leave_limits, "limits"),
    "velocity_limit": kind(lower_limit("max_velocity"), "speed"),
    "acceleration_limit": kind(lower_limit("max_acceleration"), "acceleration"),
    "jerk_limit": kind(lower_limit("max_jerk"), "jerk"),
    "start_changed": kind(change_end("start"), "start"),
    "goal_changed": kind(change_end("goal"), "goal"),
    "time_repeated": kind(break_times(lambda t, k: [*t[:k], t[k - 1], *t[k + 1 :]]), "times"),
    "time_goes_back": kind(break_times(lambda t, k: [*t[:k], t[k - 1] - 1e-6, *t[k + 1 :]]), "times"),
    "time_not_finite": kind(break_times(lambda t, k: [*t[:k], (math.nan, math.inf)[k % 2], *t[k + 1 :]]), "finite"),
    "time_lost": kind(break_times(lambda t, k: [*t[:k], *t[k + 1 :]]), "shape"),
    "begin_late": kind(break_times(lambda t, _: [at + 1e-6 for at in t]), "times"),
    "arm_lost": kind(lose_arm, "schema", "shape"),
    "row_lost": kind(break_rows(lambda q, k: q[:k] + q[k + 1 :]), "shape"),
    "number_lost": kind(break_rows(lambda q, k: [*q[:k], q[k][:-1], *q[k + 1 :]]), "schema", "shape"),
    "number_not_finite": kind(break_rows(lambda q, k: [*q[:k], [math.nan, *q[k][1:]], *q[k + 1 :]]), "finite"),
}
"""Name -> kind of violation."""
