"""Plants violations in valid plans, and asks the checker: JSON lines. Usage: attack_checker.py [--faults N] [--plans N]

Each violation is shown to be one before it counts, without the checker: contacts and margins by dense samples of the
native core's distances, all others by their construction. The valid plans must be accepted, the others refused.
"""

from __future__ import annotations

import argparse
import copy
import itertools
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from typing import Any

import numpy as np
from figure import print_figure

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import Obstacle, check_plan, draw_problem, find_cell
from mmp_env.errors import MmpError
from mmp_env.files.plan_check import plan_to_check
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.retime import retime
from mmp_planners import make

Document = dict[str, Any]
Rng = np.random.Generator
CELLS = (("ring-2", None), ("ring-6", None), ("ring-2-panda", None), ("ring-4", None), ("ring-2-held", None))
"""Cells and robots. In the last one every arm holds a box."""
PLANNER, TIME_LIMIT_S = "rrt-connect", 10.0
KNOWN_PLANS = 40
"""Plans of a process in which faults are planted."""
SURE_M = 1e-4
"""What a planted violation is closer than the margin, at least [m]."""
DENSE = 400
"""Samples of a line."""


def main() -> int:
    """Prints how many violations of each kind were planted and found. Returns 1 if one was missed."""
    parser = Parser("attack_checker.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", type=whole, default=10_000, metavar="N", help="violations (default: 10000)")
    parser.add_argument("--plans", type=whole, default=1000, metavar="N", help="valid plans (default: 1000)")
    parser.add_argument("--workers", type=whole, default=2, metavar="N", help="processes (default: 2)")
    args = parser.parse()
    planted, found, missed = Counter[str](), Counter[str](), []
    with ProcessPoolExecutor(args.workers) as pool:
        valid = sum(pool.map(accepted, range(args.plans), chunksize=10))
        for kind, refused, words in pool.map(attacked, range(args.faults), chunksize=25):
            planted[kind] += 1
            found[kind] += refused
            if not refused:
                missed.append(f"{kind}: {words}")
    for kind in KINDS:
        print_figure(f"checker_{kind}", found[kind], "violations", planted=planted[kind])
    print_figure("checker_violations", sum(found.values()), "violations", planted=args.faults)
    print_figure("checker_plans", valid, "valid plans accepted", plans=args.plans)
    for line in missed:
        print(f"# missed {line}")
    return int(bool(missed) or valid < args.plans)


def accepted(number: int) -> bool:
    """Returns whether the checker accepts a plan of a planner."""
    return check_plan(document(number)).valid


def attacked(number: int) -> tuple[str, bool, str]:
    """Returns the kind of a planted violation, whether the checker refuses the plan, and what was planted."""
    for attempt in itertools.count():
        rng = np.random.default_rng((number, attempt))
        kind = list(KINDS)[number % len(KINDS)]
        given = copy.deepcopy(document(int(rng.integers(KNOWN_PLANS)) + KNOWN_PLANS * (number % 2)))
        if KINDS[kind](given, rng):
            return kind, not check_plan(given).valid, f"{number}, attempt {attempt}"
    raise AssertionError


@cache
def cell_of(name: str, robot: str | None) -> Cell:
    """Returns a cell; in one with `-held` every arm holds a box."""
    cell = find_cell(name.removesuffix("-held"), robot=robot)
    if not name.endswith("-held"):
        return cell
    box = Obstacle(
        name="held",
        shape="box",
        position=np.array([0.0, 0.0, 0.06]),
        quaternion=np.array([1.0, 0, 0, 0]),
        size=np.array([0.06, 0.06, 0.1]),
    )
    arms = [
        Arm(name=a.name, robot=a.robot, tool=a.tool, position=a.position, quaternion=a.quaternion, held=box)
        for a in cell.arms
    ]
    return Cell(name="held", arms=tuple(arms), obstacles=cell.obstacles)


@cache
def document(number: int) -> Document:
    """Returns a valid plan as a document; every second one is retimed."""
    for attempt in itertools.count():
        cell = cell_of(*CELLS[number % len(CELLS)])
        problem = draw_problem(cell, "crossing", 1000 * attempt + number)
        plan = make(PLANNER).plan(problem, seed=number, time_limit=TIME_LIMIT_S).plan
        if plan is not None and plan.cost_rad > 0:
            return plan_to_check(retime(plan, rate=50.0) if number % 2 else plan)
    raise AssertionError


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


def lower_limit(key: str) -> Callable[[Document, Rng], bool]:
    """Returns a fault that states a limit just below the largest rate of a joint, by two millionths of it."""
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


def change_end(which: str) -> Callable[[Document, Rng], bool]:
    """Returns a fault that states another start or goal than the plan has."""

    def fault(given: Document, rng: Rng) -> bool:
        arm = any_arm(given, rng)
        q = np.array(given["problem"][which][arm], dtype=float)
        q[int(rng.integers(len(q)))] += float(rng.choice([-1, 1])) * 3e-6
        given["problem"][which][arm] = q.tolist()
        return True

    return fault


def break_times(given: Document, rng: Rng) -> bool:
    """Makes the times equal, descending, not finite or too few."""
    times = [float(t) for t in given["times"]]
    k = int(rng.integers(1, len(times)))
    kind = int(rng.integers(5))
    if kind == 0:
        times[k] = times[k - 1]
    elif kind == 1:
        times[k] = times[k - 1] - 1e-6
    elif kind == 2:
        times[k] = float(rng.choice([np.nan, np.inf]))
    elif kind == 3:
        del times[k]
    else:
        times = [t + 1e-6 for t in times]
    given["times"] = times
    return True


def lose_rows(given: Document, rng: Rng) -> bool:
    """Leaves out an arm, or a row or number of it."""
    arm = any_arm(given, rng)
    rows = [list(map(float, row)) for row in given["positions"][arm]]
    k, kind = int(rng.integers(len(rows))), int(rng.integers(4))
    if kind == 0:
        del given["positions"][arm]
        return True
    if kind == 1:
        del rows[k]
    elif kind == 2:
        rows[k] = rows[k][:-1]
    else:
        rows[k][0] = float("nan")
    given["positions"][arm] = rows
    return True


KINDS: dict[str, Callable[[Document, Rng], bool]] = {
    "contact_between_samples": swing,
    "margin_raised": raise_margin,
    "base_moved": move_base,
    "obstacle_added": add_obstacle,
    "moving_obstacle_added": add_moving_obstacle,
    "held_object_grown": grow_held,
    "joint_limit_left": leave_limits,
    "velocity_limit": lower_limit("max_velocity"),
    "acceleration_limit": lower_limit("max_acceleration"),
    "jerk_limit": lower_limit("max_jerk"),
    "start_changed": change_end("start"),
    "goal_changed": change_end("goal"),
    "times_broken": break_times,
    "rows_lost": lose_rows,
}
"""Kind of violation -> a function that plants it, and returns whether it is one."""


if __name__ == "__main__":
    run_script(main)
