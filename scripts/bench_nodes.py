"""Nodes, time and waits of `apf-ecbs` beside `ecbs` on many instances. Usage: bench_nodes.py [CELL...] [--count N]

Two JSON lines for each cell. `nodes_CELL`: how many times fewer nodes `apf-ecbs` expands, on the mean over the
instances of task `reach` that both solve within 10 s, with the 90 % interval of resampled instances. A few hard
instances have most of the nodes, so 50 instances give an uncertain ratio. `time_ratio` is that of the median planning
times.

`waits_CELL` is about the arm that arrives last, on the same instances. `travel` is how long its path takes at the
velocity limits of its joints [s, mean]. In the rest of the makespan it stands still or moves more slowly: the value of
the line [s, mean]. Keys that end with `_of_ecbs` are those of `ecbs`.
"""

from __future__ import annotations

import argparse

import numpy as np
from figure import print_figure, rounded
from resampling import interval

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import Plan, draw_problem, find_cell
from mmp_env.errors import MmpError
from mmp_planners import make

CELLS = ("ring-4", "ring-6", "ring-8")
PLANNERS = ("ecbs", "apf-ecbs")
TIME_LIMIT_S = 10.0


def main() -> None:
    """Prints the figure of each cell."""
    parser = Parser("bench_nodes.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", nargs="*", default=CELLS, metavar="CELL", help=f"default: {' '.join(CELLS)}")
    parser.add_argument("--count", type=whole, default=300, metavar="N", help="instances (default: 300)")
    args = parser.parse()
    for name in args.cells:
        compare(name, args.count)


def compare(name: str, count: int) -> None:
    """Prints the figures of one cell."""
    cell, nodes, times, last_arms = find_cell(name), [], [], []
    for seed in range(count):
        problem = draw_problem(cell, seed=seed)
        results = [make(planner).plan(problem, seed=seed, time_limit=TIME_LIMIT_S) for planner in PLANNERS]
        if all(result.plan is not None for result in results):
            nodes.append([result.stats["expanded_nodes"] for result in results])
            times.append([result.stats["planning_time_s"] for result in results])
            last_arms.append([rest_and_travel(result.plan) for result in results if result.plan is not None])
    of_ecbs, ours = np.array(nodes, dtype=float).T
    if not ours.any():
        raise MmpError(f"apf-ecbs expands no node on {len(ours)} instances of {name}, so there is no ratio")
    low, high = interval(of_ecbs, ours, least=1.0)
    slower, faster = np.median(times, axis=0)
    print_figure(
        f"nodes_{name}",
        float(of_ecbs.sum() / ours.sum()),
        "times fewer expanded nodes",
        low=rounded(low),
        high=rounded(high),
        solved=len(ours),
        instances=count,
        time_ratio=rounded(float(slower / faster)),
    )
    (rest_of_ecbs, travel_of_ecbs), (rest, travel) = np.mean(last_arms, axis=0).tolist()
    print_figure(
        f"waits_{name}",
        rest,
        "s",
        rest_of_ecbs=rounded(rest_of_ecbs),
        travel=rounded(travel),
        travel_of_ecbs=rounded(travel_of_ecbs),
        solved=len(ours),
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
