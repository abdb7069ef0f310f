"""Expanded nodes and time of `apf-ecbs` beside `ecbs` on many instances. Usage: bench_nodes.py [CELL...] [--count N]

A JSON line for each cell: how many times fewer nodes `apf-ecbs` expands, on the mean over the instances of task `reach`
that both solve within 10 s, with the 90 % interval of resampled instances. A few hard instances have most of the nodes,
so 50 instances give an uncertain ratio. `time_ratio` is that of the median planning times.
"""

from __future__ import annotations

import argparse

import numpy as np
from figure import print_figure, rounded
from resampling import interval

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import draw_problem, find_cell
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
    """Prints the ratio of one cell."""
    cell, nodes, times = find_cell(name), [], []
    for seed in range(count):
        problem = draw_problem(cell, seed=seed)
        results = [make(planner).plan(problem, seed=seed, time_limit=TIME_LIMIT_S) for planner in PLANNERS]
        if all(result.plan is not None for result in results):
            nodes.append([result.stats["expanded_nodes"] for result in results])
            times.append([result.stats["planning_time_s"] for result in results])
    of_ecbs, ours = np.array(nodes, dtype=float).T
    low, high = interval(of_ecbs, ours, least=1.0)
    slower, faster = np.median(times, axis=0)
    print_figure(
        f"nodes_{name}",
        float(of_ecbs.sum() / max(ours.sum(), 1)),
        "times fewer expanded nodes",
        low=rounded(low),
        high=rounded(high),
        solved=len(ours),
        instances=count,
        time_ratio=rounded(float(slower / faster)),
    )


if __name__ == "__main__":
    run_script(main)
