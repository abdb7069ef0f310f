"""Waits in the plans of `apf-ecbs` and `ecbs`, as JSON lines. Usage: bench_waits.py [CELL...] [--count N]

The makespan of a plan is the time until its last arm arrives. Until then this arm moves or waits. The line of a cell
has the mean of its waits, and as `motion` the mean rest of the makespan, over the instances of task `reach` that both
planners solve within 10 s. Keys that end with `_of_ecbs` are those of `ecbs`.
"""

from __future__ import annotations

import argparse

import numpy as np
from bench_nodes import CELLS, PLANNERS, TIME_LIMIT_S
from figure import print_figure, rounded

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import Plan, draw_problem, find_cell
from mmp_planners import make

MOVES_RAD = 1e-9
"""Least move of a joint in a time step that counts as motion [rad]."""


def main() -> None:
    """Prints the figure of each cell."""
    parser = Parser("bench_waits.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", nargs="*", default=CELLS, metavar="CELL", help=f"default: {' '.join(CELLS)}")
    parser.add_argument("--count", type=whole, default=50, metavar="N", help="instances (default: 50)")
    args = parser.parse()
    for name in args.cells:
        compare(name, args.count)


def compare(name: str, count: int) -> None:
    """Prints the waits in one cell."""
    cell, waits, motions = find_cell(name), [], []
    for seed in range(count):
        problem = draw_problem(cell, seed=seed)
        results = (make(planner).plan(problem, seed=seed, time_limit=TIME_LIMIT_S) for planner in PLANNERS)
        plans = [result.plan for result in results if result.plan is not None]
        if len(plans) == len(PLANNERS):
            waits.append([wait_of_last_arm(plan) for plan in plans])
            motions.append([plan.makespan_s for plan in plans])
    of_ecbs, ours = np.mean(waits, axis=0)
    motion_of_ecbs, motion = np.mean(motions, axis=0) - (of_ecbs, ours)
    print_figure(
        f"waits_{name}",
        float(ours),
        "s",
        waits_of_ecbs=rounded(float(of_ecbs)),
        motion=rounded(float(motion)),
        motion_of_ecbs=rounded(float(motion_of_ecbs)),
        solved=len(waits),
        instances=count,
    )


def wait_of_last_arm(plan: Plan) -> float:
    """Returns how long the arm that arrives last stands still before it arrives [s]."""
    steps = np.diff(plan.times)
    arrivals = [(0.0, 0.0)]
    for positions in plan.positions.values():
        moves = np.abs(np.diff(positions, axis=0)).max(axis=1) > MOVES_RAD
        before = steps[: np.flatnonzero(moves)[-1] + 1] if moves.any() else steps[:0]
        arrivals.append((float(before.sum()), float(before[~moves[: len(before)]].sum())))
    return max(arrivals)[1]


if __name__ == "__main__":
    run_script(main)
