"""Waits of the last arm in plans of `apf-ecbs` and `ecbs`, JSON lines. Usage: bench_waits.py [CELL...] [--count N]

The makespan of a plan is the time until its last arm arrives. `travel` is how long the path of this arm takes at the
velocity limits of its joints. In the rest of the makespan the arm stands still or moves more slowly. The line of a cell
has the mean rest, and the mean `travel`, over the instances of task `reach` that both planners solve within 10 s. Keys
that end with `_of_ecbs` are those of `ecbs`.
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


def main() -> None:
    """Prints the figure of each cell."""
    parser = Parser("bench_waits.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", nargs="*", default=CELLS, metavar="CELL", help=f"default: {' '.join(CELLS)}")
    parser.add_argument("--count", type=whole, default=50, metavar="N", help="instances (default: 50)")
    args = parser.parse()
    for name in args.cells:
        compare(name, args.count)


def compare(name: str, count: int) -> None:
    """Prints the figure of one cell."""
    cell, times = find_cell(name), []
    for seed in range(count):
        problem = draw_problem(cell, seed=seed)
        results = (make(planner).plan(problem, seed=seed, time_limit=TIME_LIMIT_S) for planner in PLANNERS)
        plans = [result.plan for result in results if result.plan is not None]
        if len(plans) == len(PLANNERS):
            times.append([time for plan in plans for time in rest_and_travel(plan)])
    of_ecbs, travel_of_ecbs, ours, travel = np.reshape(times, (-1, 4)).mean(axis=0).tolist()
    print_figure(
        f"waits_{name}",
        ours,
        "s",
        rest_of_ecbs=rounded(of_ecbs),
        travel=rounded(travel),
        travel_of_ecbs=rounded(travel_of_ecbs),
        solved=len(times),
        instances=count,
    )


def rest_and_travel(plan: Plan) -> tuple[float, float]:
    """Returns the rest of the makespan and the travel time [s] of the arm that arrives last."""
    arrivals = [(0.0, 0.0)]
    for arm, positions in plan.positions.items():
        needed = (np.abs(np.diff(positions, axis=0)) / plan.problem.max_velocity[arm]).max(axis=1)
        moving = np.flatnonzero(needed)
        arrivals.append((float(plan.times[moving[-1] + 1]) if len(moving) else 0.0, float(needed.sum())))
    arrival, travel = max(arrivals)
    return arrival - travel, travel


if __name__ == "__main__":
    run_script(main)
