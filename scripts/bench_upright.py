"""Plans whose tools stay upright: solved, time, cost and largest angle, and planted violations that the checker finds.

Usage: bench_upright.py [--count 50] [--planted 100]. `auto` plans drawn instances of four UR5e and of four Pandas in a
ring, and every plan is retimed. Angles are those of MuJoCo's kinematics every millisecond, relative to their bound.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median
from typing import Any

import mujoco
import numpy as np
from figure import print_figure
from upright_instances import KINDS, upright_problem, with_violation

import mmp_env
import mmp_planners
from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env.model.keep import Upright
from mmp_env.model.plan import Plan
from mmp_env.retime import retime
from mmp_env.sim.scene import compile_scene

TIME_LIMIT_S = 30.0
WITHIN_RAD = 0.2
ROBOTS, ARMS = ("ur5e", "panda"), 4
AXES = ([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
"""Axes that are kept upright, in turns: the tool points down, up, or lies flat."""
PERIOD_S = 1e-3


@dataclass(frozen=True, kw_only=True)
class UprightRun:
    """One instance. `first_s` and `whole_s` are times [s]; `angles` are those of the plan and of the retimed plan."""

    plan: Plan
    first_s: float
    whole_s: float
    valid: bool
    angles: tuple[float, float]


def main() -> None:
    """Prints the figures."""
    parser = Parser("bench_upright.py", __doc__)
    parser.add_argument("--count", type=whole, default=50)
    parser.add_argument("--planted", type=whole, default=100)
    args = parser.parse()
    print_upright(args.count, args.planted)


def print_upright(count: int, planted: int) -> None:
    """Prints the figures of `count` instances of each robot, and of planted violations."""
    plans = []
    for robot in ROBOTS:
        runs = [done for seed in range(count) if (done := run(robot, seed)) is not None]
        plans += [done.plan for done in runs]
        of: dict[str, Any] = {"of": count}
        name = f"upright_{robot}_{ARMS}"
        print_figure(f"{name}_solved", len(runs), "instances", **of)
        if not runs:
            continue
        print_figure(f"{name}_valid", sum(done.valid for done in runs), "plans", of=len(runs))
        print_figure(f"{name}_first_plan_median", 1e3 * median(done.first_s for done in runs), "ms", **of)
        print_figure(f"{name}_first_plan_max", 1e3 * max(done.first_s for done in runs), "ms", **of)
        print_figure(f"{name}_planning_median", median(done.whole_s for done in runs), "s", **of)
        print_figure(f"{name}_planning_max", max(done.whole_s for done in runs), "s", **of)
        ratios = [done.plan.cost_rad / done.plan.problem.cost_lower_bound_rad for done in runs]
        print_figure(f"{name}_cost_ratio_median", median(ratios), "1", **of)
        print_figure(f"{name}_angle_over_bound_max", max(done.angles[0] for done in runs), "1", of=len(runs))
        print_figure(f"{name}_retimed_angle_over_bound_max", max(done.angles[1] for done in runs), "1", of=len(runs))
    print_planted(plans, planted)


def run(robot: str, seed: int) -> UprightRun | None:
    """Returns the result of one instance, or None if the planner finds no plan in time."""
    bound = Upright(axis=AXES[seed % len(AXES)], within=WITHIN_RAD)
    problem = upright_problem(mmp_env.ring_cell(ARMS, robot=robot), seed, bound)
    begin = time.perf_counter()
    result = mmp_planners.make("auto").plan(problem, seed=seed, time_limit=TIME_LIMIT_S)
    spent = time.perf_counter() - begin
    if result.plan is None:
        return None
    smooth = retime(result.plan)
    return UprightRun(
        plan=result.plan,
        first_s=float(result.stats["first_plan_s"]),
        whole_s=spent,
        valid=mmp_env.check_plan(result.plan).valid and mmp_env.check_plan(smooth).valid,
        angles=(largest_angle(result.plan), largest_angle(smooth)),
    )


def largest_angle(plan: Plan) -> float:
    """Returns the largest angle of any tool axis, relative to its bound, every millisecond."""
    cell = plan.problem.cell
    model = compile_scene(cell)
    data, worst = mujoco.MjData(model), 0.0
    address = {
        arm.name: [int(model.joint(f"{arm.name}/joint{k + 1}").qposadr[0]) for k in range(arm.dof)] for arm in cell.arms
    }
    times = np.append(np.arange(0.0, plan.makespan_s, PERIOD_S), plan.makespan_s)
    states = plan.sampled(times)
    for k in range(len(times)):
        for name, q in states.items():
            data.qpos[address[name]] = q[k]
        mujoco.mj_kinematics(model, data)
        for name, bound in cell.keep.items():
            tool = cell.arm(name).tool
            frame = data.body(f"{name}/{tool.name}") if tool else data.site(f"{name}/flange")
            x, y, z = frame.xmat.reshape(3, 3) @ bound.direction
            worst = max(worst, float(np.arctan2(np.hypot(x, y), z)) / bound.within)
    return worst


def print_planted(plans: list[Plan], count: int) -> None:
    """Prints how many of the planted violations the checker finds."""
    found = [
        any(violation.rule == "upright" for violation in mmp_env.check_plan(data).violations)
        for data in _planted(plans, count)
    ]
    print_figure("upright_planted_found", sum(found), "plans", of=len(found))


def _planted(plans: list[Plan], count: int) -> Iterator[dict[str, Any]]:
    rng, made, tried = np.random.default_rng(0), 0, 0
    while made < count and tried < 100 * count and plans:
        data = with_violation(plans[tried % len(plans)], KINDS[made % len(KINDS)], rng)
        tried += 1
        if data is not None:
            made += 1
            yield data


if __name__ == "__main__":
    run_script(main)
