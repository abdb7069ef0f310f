"""Nodes, time and cost of `apf-ecbs` and `ecbs` on the same instances: JSON lines. Usage: bench_repulsion.py [CELL...]

A run is one instance of task `reach`; its number is the seed of the planner too. Means of expanded nodes and of cost
and medians of processor time are over the runs that both planners solve. Ratios above 1 are in favour of `apf-ecbs`.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from figure import print_figure, rounded

from mmp_cli.arguments import Parser, seed, whole
from mmp_cli.main import run_script
from mmp_env import draw_problem, find_cell
from mmp_planners import make

CELLS = ("ring-4", "ring-6", "ring-8")
TIME_LIMIT_S = 30.0


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Expanded nodes, processor time [s] and cost [rad] of a run; the cost is None if there is no plan."""

    nodes: int
    seconds: float
    cost_rad: float | None


def main() -> None:
    """Prints the figures of each cell."""
    parser = Parser("bench_repulsion.py", __doc__)
    parser.add_argument("cells", nargs="*", default=CELLS, metavar="CELL", help=f"default: {' '.join(CELLS)}")
    parser.add_argument("--count", type=whole, default=50, metavar="N", help="instances of a cell (default: 50)")
    parser.add_argument("--first", type=seed, default=0, metavar="SEED", help="seed of the first (default: 0)")
    args = parser.parse()
    for cell in args.cells:
        compare(cell, range(args.first, args.first + args.count))


def compare(cell: str, seeds: range) -> None:
    """Prints nodes, time and cost of both planners, and how many runs each solves."""
    rival, ours = outcomes("ecbs", cell, seeds), outcomes("apf-ecbs", cell, seeds)
    both = [pair for pair in zip(rival, ours, strict=True) if None not in (pair[0].cost_rad, pair[1].cost_rad)]
    counts: dict[str, Any] = {
        "instances": len(seeds),
        "first": seeds.start,
        "solved": solved(ours),
        "solved_ecbs": solved(rival),
    }
    if not both:
        print_figure(f"repulsion_solved_by_both_{cell}", 0, "instances", **counts)
        return
    for name, unit, values in (
        ("nodes", "nodes", [statistics.mean(run.nodes for run in runs) for runs in zip(*both, strict=True)]),
        ("time", "ms", [1e3 * statistics.median(run.seconds for run in runs) for runs in zip(*both, strict=True)]),
        ("cost", "rad", [statistics.mean(run.cost_rad or 0.0 for run in runs) for runs in zip(*both, strict=True)]),
    ):
        theirs, mine = values
        show(f"repulsion_{name}_{cell}", unit, theirs, mine, counts)


def show(name: str, unit: str, theirs: float, mine: float, counts: Mapping[str, Any]) -> None:
    """Prints the figure of `apf-ecbs`, with that of `ecbs` and their ratio beside it."""
    ratio = theirs / mine if mine else None
    print_figure(name, float(mine), unit, ratio=ratio, ratio_to="ecbs / apf-ecbs", ecbs=rounded(theirs), **counts)


def outcomes(planner: str, cell: str, seeds: Iterable[int]) -> list[Outcome]:
    """Returns the outcome of the planner for each instance."""
    out = []
    for number in seeds:
        problem = draw_problem(find_cell(cell), seed=number)
        begin = time.process_time()
        result = make(planner).plan(problem, seed=number, time_limit=TIME_LIMIT_S)
        seconds = time.process_time() - begin
        cost = None if result.plan is None else result.plan.cost_rad
        out.append(Outcome(nodes=result.stats["expanded_nodes"], seconds=seconds, cost_rad=cost))
    return out


def solved(runs: Iterable[Outcome]) -> int:
    """Returns the number of runs with a plan."""
    return sum(run.cost_rad is not None for run in runs)


if __name__ == "__main__":
    run_script(main)
