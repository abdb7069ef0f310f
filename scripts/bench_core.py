"""Speed of the native core on eight UR5e arms: a JSON line per figure. Usage: bench_core.py [--states N]

Every value is the best of many repeats on one core, because other programs only make a repeat slower; `median` is the
middle one. The states are starts and goals of the task `reach`. The motions are straight lines from start to goal, like
the root of a conflict tree. Ratios compare with MuJoCo on the same states in the same run.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np
from figure import print_figure, timed

import mmp_planners
from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import core, draw_instance, make_problem, ring_cell
from mmp_env.model.cell import Cell
from mmp_env.model.certificate import SHARE
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, REQUIRED_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.sim.scene import compile_scene

ARMS, STEP_S = 8, 0.1
PROBLEMS, PART = 5, 25
MUJOCO = "mj_kinematics + mj_collision"


@dataclass(frozen=True, kw_only=True)
class Spent:
    """Times [s] of one call."""

    best: float
    median: float

    def per(self, count: int) -> Spent:
        """Returns the times of one of the `count` items of a call."""
        return Spent(best=self.best / count, median=self.median / count)


def measure(call: Callable[[], object], repeats: int) -> Spent:
    """Measures a call, after one call that does not count."""
    call()
    times = timed(call, repeats)
    return Spent(best=times[0], median=statistics.median(times))


def measure_each(call: Callable[[Any], object], things: Sequence[Any], repeats: int) -> Spent:
    """Measures the mean time of a call with one item, in short parts, so that other programs disturb few repeats."""

    def go_through(part: Sequence[Any]) -> None:
        for thing in part:
            call(thing)

    parts = [things[k : k + PART] for k in range(0, len(things), PART)]
    spent = [measure(partial(go_through, part), repeats) for part in parts]
    return Spent(best=sum(s.best for s in spent), median=sum(s.median for s in spent)).per(len(things))


def main() -> None:
    """Prints all figures."""
    parser = Parser("bench_core.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--states", type=whole, default=1000, metavar="N", help="states in a batch (default: 1000)")
    count = parser.parse().states
    cell = ring_cell(ARMS)
    ends = [draw_instance(cell, seed=seed) for seed in range((count + 1) // 2)]
    states = [state for instance in ends for state in instance][:count]
    print_cell_checks(cell, [np.array([state[name] for state in states]) for name in cell.arm_names])
    problems = [make_problem(cell, start, goal) for start, goal in ends[:PROBLEMS]]
    print_motions(cell, problems)
    print_certificate(cell, [plan for problem in problems if (plan := planned(problem)) is not None])


def report(name: str, spent: Spent, unit: str, scale: float, rival: Spent | None = None) -> None:
    """Prints a time; the ratio is the best time of the rival relative to ours."""
    ratio, ratio_to = (rival.best / spent.best, MUJOCO) if rival else (None, None)
    median = float(f"{spent.median * scale:.4g}")
    variant = core.preferred_variant()
    print_figure(name, spent.best * scale, unit, ratio=ratio, ratio_to=ratio_to, median=median, core=variant)


def print_cell_checks(cell: Cell, rows: Sequence[np.ndarray]) -> None:
    """Prints the time of kinematics and least clearance over all pairs of arms, per state, in a batch and alone."""
    compiled, count = cell.collision.core, len(rows[0])
    rival = mujoco_check(cell, np.concatenate(rows, axis=1))
    batch = measure(lambda: core.cell_clearance(compiled, rows, obstacles=False), 100).per(count)
    report("cell_check_8x28", batch, "us", 1e6, rival)
    alone = [[row[k : k + 1] for row in rows] for k in range(count)]
    single = measure_each(lambda state: core.cell_clearance(compiled, state, obstacles=False), alone, 20)
    report("cell_check_8x28_single_state", single, "us", 1e6, rival)
    with_table = measure(lambda: core.cell_clearance(compiled, rows), 50).per(count)
    report("cell_check_8x28_and_table", with_table, "us", 1e6)
    report("mujoco_8_arms", rival, "us", 1e6)


def mujoco_check(cell: Cell, states: np.ndarray) -> Spent:
    """Measures MuJoCo on the same states. Python's share, three calls per state, is about a microsecond."""
    model = compile_scene(cell)
    data = mujoco.MjData(model)
    kinematics, collision, qpos = mujoco.mj_kinematics, mujoco.mj_collision, data.qpos

    def check(state: np.ndarray) -> None:
        qpos[:] = state
        kinematics(model, data)
        collision(model, data)

    return measure_each(check, list(states), 20)


def print_motions(cell: Cell, problems: Sequence[Problem]) -> None:
    """Prints the cost of a node of the conflict tree: spheres of eight motions, conflicts, and the force on one arm."""
    model = cell.collision
    paths, looked = (
        [straight(problem) for problem in problems],
        problems[0].levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR),
    )
    motions = [[model.motion(name, q) for name, q in path.items()] for path in paths]
    pairs = [(i, j) for i in range(ARMS) for j in range(i + 1, ARMS)]
    worked_out = measure(lambda: [model.motion(name, q) for path in paths for name, q in path.items()], 50)
    report("motion_spheres_8_arms", worked_out.per(len(paths)), "ms", 1e3)
    found = measure(lambda: [model.conflict_instants(arms, pairs, looked) for arms in motions], 50)
    report("conflicts_8_arms", found.per(len(paths)), "ms", 1e3)
    pushed = measure(lambda: [force(cell, arms, k) for arms in motions for k in range(ARMS)], 50)
    report("force_field_one_of_8_arms", pushed.per(len(paths) * ARMS), "ms", 1e3)


def straight(problem: Problem) -> dict[str, np.ndarray]:
    """Returns straight lines of all arms from start to goal at full speed, in whole steps."""
    out = {}
    for name in problem.cell.arm_names:
        start, goal = problem.start[name], problem.goal[name]
        steps = int(np.ceil((np.abs(goal - start) / (problem.max_velocity[name] * STEP_S)).max()))
        out[name] = start + np.linspace(0.0, 1.0, steps + 1)[:, None] * (goal - start)
    return out


def force(cell: Cell, motions: Sequence[core.Motion], k: int) -> np.ndarray:
    """Returns the joint forces of all other arms on arm k, with the planners' default gain and reach."""
    others = [motion for j, motion in enumerate(motions) if j != k]
    return core.repulsive_force(cell.collision.core, motions[k], others, core.RepulsionSettings())


def planned(problem: Problem) -> Plan | None:
    """Returns a plan to certify."""
    return mmp_planners.make("apf-ecbs").plan(problem, time_limit=10.0).plan


def print_certificate(cell: Cell, plans: Sequence[Plan]) -> None:
    """Prints the time of the certificate of a plan."""
    clock = core.Clock(600.0)
    positions = [[np.ascontiguousarray(plan.positions[name]) for name in cell.arm_names] for plan in plans]

    def prove() -> None:
        for plan, q in zip(plans, positions, strict=True):
            required = plan.problem.levels(REQUIRED_MARGIN_FACTOR, REQUIRED_MARGIN_FACTOR)
            core.certify(cell.collision.core, q, required, SHARE, clock)

    report("certificate_8_arms", measure(prove, 10).per(len(plans)), "ms", 1e3)


if __name__ == "__main__":
    run_script(main)
