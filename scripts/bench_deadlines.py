"""How late planners return after their time limit: JSON lines. Usage: bench_deadlines.py [PLANNER...]

Each planner plans instances of eight Pandas in a ring with time limits from 1 ms on. `crowd` is a line of 64 arms with
1,000 small boxes above it. With limits above 30 ms the planners have options that keep them at work until the limit.
Lateness is the wall-clock time beyond the limit, 0 for a run that returns before, over the runs that the limit ended:
those that say so, and those that return late. The lines have its 99th percentile, its largest value, the limit of the
largest, how many of the runs the limit ended, and the longest limit that ended one. It ends with 1 if a largest value
is above 20 ms, a percentile of the Pandas above 5 ms, or if a limit ended no run of a planner.

It calls `gc.freeze()` before the first plan: a garbage collection that visits all objects of the process takes tens of
milliseconds, and may begin in any plan.
"""

from __future__ import annotations

import argparse
import gc
import sys
import time
from dataclasses import replace

import numpy as np
from figure import print_figure, rounded

from mmp_cli.arguments import Parser, seconds, whole
from mmp_cli.main import run_script
from mmp_env import Obstacle, draw_problem, find_cell, make_problem
from mmp_env.errors import UnknownNameError
from mmp_env.model.problem import Problem
from mmp_planners import make, names

CELL, CROWD = "ring-8-panda", "line-64"
LIMITS_S = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
SHORT_S, OFTEN = 0.03, 10
"""Limits up to `SHORT_S` [s] have `OFTEN` times as many runs."""
MANY = 10**7
"""Number of attempts, rounds or expansions that no run reaches."""
ENDLESS_TREE = {"bound": "straight", "patience": MANY}
"""Options of a conflict tree that looks for plans of the length of the straight lines, and never has enough."""
BUSY = {
    "cbs": ENDLESS_TREE,
    "cbs-mp": ENDLESS_TREE,
    **{name: ENDLESS_TREE | {"w": 1.0} for name in ("apf-ecbs", "apf-ecbs-nf", "ecbs", "gen-ecbs", "xecbs")},
    **{name: {"range": 0.01, "shorten": MANY} for name in ("group-rrt", "rrt-connect")},
    "auto": {"until": 1.0, "rounds": MANY, "shorten": MANY},
    "prioritized": {"shorten": MANY},
}
"""Planner -> options with limits above `SHORT_S`: short edges, many attempts, and no plan that is good enough."""
MOST_MS, WORST_MS = 5.0, 20.0
"""Bounds of the 99th percentile and of the largest lateness [ms]; the crowd has only the second."""
BOXES, EDGE_M, HEIGHT_M = 1000, 0.02, 2.5


def main() -> int:
    """Prints the lateness of each planner on both cells. Returns 1 if one is too late, or a limit ended no run."""
    parser = Parser("bench_deadlines.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("planners", nargs="*", default=names(), metavar="PLANNER", help="default: all")
    parser.add_argument("--count", type=whole, default=10, metavar="N", help="instances of a limit (default: 10)")
    parser.add_argument("--most", type=seconds, default=1.0, metavar="S", help="largest limit [s] (default: 1)")
    parser.add_argument("--crowd", type=whole, default=3, metavar="N", help="instances of the crowd (default: 3)")
    args = parser.parse()
    for name in args.planners:
        if name not in names():
            raise UnknownNameError("planner", name, names())
    cell = find_cell(CELL)
    problems = [draw_problem(cell, seed=seed) for seed in range(args.count)]
    crowd = [crowded(draw_problem(find_cell(CROWD), seed=seed)) for seed in range(args.crowd)]
    limits = [limit for limit in LIMITS_S if limit <= args.most]
    gc.collect()
    gc.freeze()
    failed = False
    for name in args.planners:
        p99_ms, worst_ms, unused = show(f"lateness_{CELL}_{name}", name, problems, limits)
        _, crowd_ms, unused_of_crowd = show(f"lateness_crowd_{name}", name, crowd, limits)
        failed |= p99_ms > MOST_MS or max(worst_ms, crowd_ms) > WORST_MS
        for cell_name, unused_s in ((CELL, unused), ("crowd", unused_of_crowd)):
            if unused_s:
                failed = True
                limits_text = ", ".join(f"{limit:g} s" for limit in unused_s)
                print(f"{name}, {cell_name}: no run was ended by the limits {limits_text}", file=sys.stderr)
    return int(failed)


def crowded(problem: Problem) -> Problem:
    """Returns the problem with a grid of small boxes above the arms, out of their way."""
    side = int(np.ceil(np.sqrt(BOXES)))
    boxes = tuple(
        Obstacle(
            name=f"box{k}",
            shape="box",
            position=np.array([0.1 * (k % side - side / 2), 0.1 * (k // side - side / 2), HEIGHT_M]),
            quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
            size=np.full(3, EDGE_M),
        )
        for k in range(BOXES)
    )
    cell = replace(problem.cell, obstacles=(*problem.cell.obstacles, *boxes))
    return make_problem(cell, problem.start, problem.goal)


def show(name: str, planner: str, problems: list[Problem], limits: list[float]) -> tuple[float, float, list[float]]:
    """Prints 99th percentile and largest lateness [ms] over all problems and limits.

    Returns both, and the limits [s] that ended no run.
    """
    make(planner).plan(problems[0], seed=0, time_limit=limits[0])  # what the first call of a process loads
    late, runs = [], 0
    for limit in limits:
        options = BUSY.get(planner, {}) if limit > SHORT_S else {}
        for seed in range(len(problems) * (OFTEN if limit <= SHORT_S else 1)):
            begin = time.perf_counter()
            result = make(planner, **options).plan(problems[seed % len(problems)], seed=seed, time_limit=limit)
            lateness, runs = time.perf_counter() - begin - limit, runs + 1
            if lateness > 0 or result.stats.get("deadline_hit"):
                late.append((max(lateness, 0.0), limit))
    worst, at = max(late, default=(0.0, 0.0))
    p99_ms, worst_ms = 1e3 * float(np.quantile([seconds for seconds, _ in late] or [0.0], 0.99)), 1e3 * worst
    more = {"worst_ms": rounded(worst_ms), "worst_at_limit_s": at, "runs": runs, "reached_limit": len(late)}
    print_figure(name, p99_ms, "ms", **more, longest_limit_s=max((limit for _, limit in late), default=0.0))
    return p99_ms, worst_ms, [limit for limit in limits if limit not in {reached for _, reached in late}]


if __name__ == "__main__":
    run_script(main)
