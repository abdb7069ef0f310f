"""Wrong numbers, limits, times and fields that `planted_violations.py` plants; they are violations by construction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from attacked_plan import Document, Plant, Rng, any_arm, is_retimed, meant_cell, rows_of

from mmp_env.check.rules import MOST_TURN_RAD

EXCESS = 1e-6
"""Relative excess of a limit. The checker has a tolerance of 1e-9 for velocities, and of 1e-7 for the others."""
SLOWEST = 0.1
"""Least rate [rad/s^n] whose limit is lowered. The rounding of smaller ones is too large for the excess."""
PACE = 0.1
"""Speed of planted motions, as a share of the velocity limits."""


def leave_limits(given: Document, rng: Rng) -> bool:
    """Lets a joint leave its limits by 1e-6 rad."""
    arm, rows = any_arm(given, rng), rows_of(given)
    robot, k = meant_cell(given).arm(arm).robot, int(rng.integers(len(rows[arm])))
    joint = int(rng.integers(robot.dof))
    given["positions"][arm] = rows[arm].tolist()
    given["positions"][arm][k][joint] = float(rng.choice([robot.lower[joint] - 1e-6, robot.upper[joint] + 1e-6]))
    return True


def shrink_carried(file: str) -> Plant:
    """Returns a violation: the shapes in one file of a carried robot, hulls.json or spheres.json, shrink to a half."""

    def plant(given: Document, rng: Rng) -> bool:
        robots = given["problem"]["cell"].get("robots")
        if not robots:
            return False
        content = robots[str(rng.choice(sorted(robots)))]
        content[file] = _halved(content[file])
        return True

    return plant


def raise_carried(given: Document, rng: Rng) -> bool:
    """Raises the velocity of a joint of a carried robot by 1e-6 rad/s."""
    robots = given["problem"]["cell"].get("robots")
    if not robots:
        return False
    joints = robots[str(rng.choice(sorted(robots)))]["robot.json"]["joints"]
    joints[int(rng.integers(len(joints)))]["velocity"] += 1e-6
    return True


def _halved(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _halved(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_halved(part) for part in value]
    return value / 2 if isinstance(value, float) else value


def lower_limit(key: str) -> Plant:
    """Returns a violation: the problem states a limit just below the largest rate of a joint."""
    order = {"max_velocity": 1, "max_acceleration": 2, "max_jerk": 3}[key]

    def plant(given: Document, rng: Rng) -> bool:
        problem = given["problem"]
        if problem.get(key) is None or (order > 1 and not is_retimed(given)):
            return False
        arm, times = any_arm(given, rng), np.array(given["times"])
        q = rows_of(given)[arm]
        resting = np.pad(q, ((order, order), (0, 0)), mode="edge") if order > 1 else q
        step = np.diff(times)[:, None] if order == 1 else times[1] - times[0]
        largest = np.abs(np.diff(resting, n=order, axis=0) / step**order).max(axis=0)
        joint = int(np.argmax(largest))
        if largest[joint] < SLOWEST:
            return False
        limits = {name: list(map(float, values)) for name, values in problem[key].items()}
        limits[arm][joint] = largest[joint] / (1 + EXCESS)
        problem[key] = limits
        return True

    return plant


def hurry(given: Document, rng: Rng) -> bool:
    """Makes the plan so fast that a joint exceeds its robot's velocity; the problem allows more."""
    cell, times = meant_cell(given), np.array(given["times"], dtype=float)
    step = np.diff(times)[:, None]
    rates = [(np.abs(np.diff(q, axis=0)) / step / cell.arm(a).robot.velocity).max() for a, q in rows_of(given).items()]
    given["times"] = (times * (max(rates) / (1 + EXCESS))).tolist()
    given["problem"]["max_velocity"] = 1000.0
    return True


def misstate(key: str) -> Plant:
    """Returns a violation: velocities, or accelerations, that differ just too much from the motion in one step.

    The mean of a rate at both ends of a step of h seconds may differ from the motion's by a h / 4 and j h^2 / 12 for
    velocities, and by j h / 4 for accelerations, where a and j are the limits.
    """
    integral = {"velocities": "positions", "accelerations": "velocities"}[key]

    def plant(given: Document, rng: Rng) -> bool:
        problem = given["problem"]
        if not is_retimed(given) or not isinstance(problem.get("max_jerk"), dict):
            return False
        arm, times = any_arm(given, rng), given["times"]
        rates, moved = rows_of(given, key)[arm], rows_of(given, integral)[arm]
        k, joint = int(rng.integers(len(times) - 1)), int(rng.integers(rates.shape[1]))
        h, jerk = times[k + 1] - times[k], problem["max_jerk"][arm][joint]
        allowed = jerk * h / 4
        if key == "velocities":
            allowed = min(problem["max_acceleration"][arm][joint] * h / 4, jerk * h**2 / 12)
        mean = (moved[k + 1, joint] - moved[k, joint]) / h + float(rng.choice([-1, 1])) * allowed * (1 + EXCESS)
        rates[k + 1, joint] = 2 * mean - rates[k, joint]
        given[key][arm] = rates.tolist()
        return True

    return plant


def turn_for_hours(given: Document, rng: Rng) -> bool:
    """Lets a joint turn slowly back and forth until the whole motion is 1e-6 longer than what the checker proves."""
    if is_retimed(given):
        return False
    arm, rows, times = any_arm(given, rng), rows_of(given), np.array(given["times"], dtype=float)
    robot, k = meant_cell(given).arm(arm).robot, int(rng.integers(len(times)))
    joint = int(rng.integers(robot.dof))
    low, at, high = robot.lower[joint], rows[arm][k, joint], robot.upper[joint]
    side = low - at if at - low > high - at else high - at
    own = np.abs(np.diff(np.hstack(list(rows.values())), axis=0)).max(axis=1).sum()
    missing = MOST_TURN_RAD * (1 + 1e-6) - own
    swings = int(np.ceil(missing / (2 * abs(side))))
    for name, q in rows.items():
        added = np.repeat(q[k : k + 1], 2 * swings, axis=0)
        if name == arm:
            added[::2, joint] += np.sign(side) * missing / (2 * swings)
        given["positions"][name] = np.insert(q, k + 1, added, axis=0).tolist()
    leg = abs(side) / (PACE * float(robot.velocity[joint]))
    later = times[k] + leg * np.arange(1, 2 * swings + 1)
    given["times"] = [*times[: k + 1], *later, *(times[k + 1 :] + leg * 2 * swings)]
    return True


def change_end(which: str) -> Plant:
    """Returns a violation: the problem states another start or goal than the plan has."""

    def plant(given: Document, rng: Rng) -> bool:
        arm = any_arm(given, rng)
        q = np.array(given["problem"][which][arm], dtype=float)
        q[int(rng.integers(len(q)))] += float(rng.choice([-1, 1])) * 3e-6
        given["problem"][which][arm] = q.tolist()
        return True

    return plant


def break_times(broken: Callable[[list[float], int], list[float]]) -> Plant:
    """Returns a violation of the times; `broken` gets them and a number from 1 on."""

    def plant(given: Document, rng: Rng) -> bool:
        times = [float(t) for t in given["times"]]
        given["times"] = broken(times, int(rng.integers(1, len(times))))
        return True

    return plant


def break_rows(broken: Callable[[list[list[float]], int], list[list[float]]]) -> Plant:
    """Returns a violation of an arm's configurations; `broken` gets them and the number of one."""

    def plant(given: Document, rng: Rng) -> bool:
        arm = any_arm(given, rng)
        rows = [list(map(float, row)) for row in given["positions"][arm]]
        given["positions"][arm] = broken(rows, int(rng.integers(len(rows))))
        return True

    return plant


def lose_arm(given: Document, rng: Rng) -> bool:
    """Leaves out an arm."""
    del given["positions"][any_arm(given, rng)]
    return True


def add_field(given: Document, rng: Rng) -> bool:
    """Gives an arm of the cell a field that might change its geometry."""
    arms = given["problem"]["cell"]["arms"]
    arms[int(rng.integers(len(arms)))]["scale"] = 1.0
    return True


def write_number_as_text(given: Document, rng: Rng) -> bool:
    """Writes a joint's position as text."""
    arm, rows = any_arm(given, rng), rows_of(given)
    given["positions"][arm] = rows[arm].tolist()
    k = int(rng.integers(len(rows[arm])))
    given["positions"][arm][k][0] = str(rows[arm][k, 0])
    return True
