"""Nodes, time and cost with and without repulsion, as JSON lines. Usage: bench_repulsion.py [CELL...]

A run is one instance of task `reach` with one seed of the planner: the number of the instance, plus 1000 for each
further seed. Means of expanded nodes and of cost and medians of processor time are over the runs that both planners
solve. By default `apf-ecbs` is compared with `ecbs`. Ratios above 1 are in favour of `--planner`, with the options that
`--set` gives it, against `--base` with its defaults. The ratio of nodes of each seed is in `ratios`. A figure is named
`repulsion/PLANNER OPTION=VALUE/WHAT_CELL`. With `--exact` the links have exact geometry, and the name ends with
`-exact`.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from figure import print_figure, rounded

from mmp_cli.arguments import Parser, seconds, seed, setting, whole
from mmp_cli.main import run_script
from mmp_env import Cell, draw_problem, find_cell
from mmp_env.errors import MmpError
from mmp_planners import make
from mmp_planners.planner import Planner
from mmp_planners.tree_planner import TreePlanner

CELLS = ("ring-4", "ring-6", "ring-8")
SEED_STEP = 1000
Named = tuple[str, Planner]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Expanded nodes, processor time [s] and cost [rad] of a run; the cost is None if there is no plan."""

    repeat: int
    nodes: int
    seconds: float
    cost_rad: float | None


@dataclass(frozen=True, kw_only=True)
class Runs:
    """Runs of a planner: each instance of the cell with each planner seed, within a time limit [s]."""

    name: str
    cell: Cell
    instances: range
    seeds: int
    time_limit: float

    def outcomes(self, planner: Planner) -> list[Outcome]:
        """Returns the outcome of each run."""
        out = []
        for number in self.instances:
            problem = draw_problem(self.cell, seed=number)
            for repeat in range(self.seeds):
                begin = time.process_time()
                result = planner.plan(problem, seed=number + SEED_STEP * repeat, time_limit=self.time_limit)
                took = time.process_time() - begin
                cost = None if result.plan is None else result.plan.cost_rad
                out.append(Outcome(repeat=repeat, nodes=result.stats["expanded_nodes"], seconds=took, cost_rad=cost))
        return out


def main() -> None:
    """Prints the figures of each cell."""
    parser = Parser("bench_repulsion.py", __doc__)
    parser.add_argument("cells", nargs="*", default=CELLS, metavar="CELL", help=f"default: {' '.join(CELLS)}")
    parser.add_argument("--count", type=whole, default=50, metavar="N", help="instances of a cell (default: 50)")
    parser.add_argument("--first", type=seed, default=0, metavar="SEED", help="seed of the first (default: 0)")
    parser.add_argument("--seeds", type=whole, default=1, metavar="N", help="planner seeds per instance (default: 1)")
    parser.add_argument("--time-limit", type=seconds, default=30.0, metavar="S", help="for each run (default: 30)")
    parser.add_argument("--planner", default="apf-ecbs", metavar="NAME", help="default: apf-ecbs")
    parser.add_argument("--base", default="ecbs", metavar="NAME", help="planner to compare with (default: ecbs)")
    parser.add_argument(
        "--set", type=setting, action="append", default=[], metavar="OPTION=VALUE", help="option of this planner"
    )
    parser.add_argument("--exact", action="store_true", help="exact geometry instead of the cell's spheres")
    args = parser.parse()
    for name in (args.planner, args.base):
        if not isinstance(make(name), TreePlanner):
            raise MmpError(f"planner '{name}' has no conflict tree, so there are no nodes to compare")
    label = " ".join([args.planner, *(f"{option}={value}" for option, value in args.set)])
    for name in args.cells:
        cell = replace(find_cell(name), spheres="exact") if args.exact else find_cell(name)
        instances = range(args.first, args.first + args.count)
        shown = f"{name}-exact" if args.exact else name
        runs = Runs(name=shown, cell=cell, instances=instances, seeds=args.seeds, time_limit=args.time_limit)
        compare(runs, (label, make(args.planner, **dict(args.set))), (args.base, make(args.base)))


def compare(runs: Runs, planner: Named, base: Named) -> None:
    """Prints nodes, time and cost of both planners, and how many runs each solves."""
    cell, instances, seeds = runs.name, runs.instances, runs.seeds
    rival, ours = runs.outcomes(base[1]), runs.outcomes(planner[1])
    both = [pair for pair in zip(rival, ours, strict=True) if None not in (pair[0].cost_rad, pair[1].cost_rad)]
    counts: dict[str, Any] = {
        "instances": len(instances),
        "first": instances.start,
        "seeds": seeds,
        "time_limit_s": runs.time_limit,
        "solved": solved(ours),
        "solved_base": solved(rival),
    }
    if not both:
        print_figure(f"repulsion/{planner[0]}/solved_by_both_{cell}", 0, "runs", **counts)
        return
    for name, unit, values in (
        ("nodes", "nodes", [statistics.mean(run.nodes for run in side) for side in zip(*both, strict=True)]),
        ("time", "ms", [1e3 * statistics.median(run.seconds for run in side) for side in zip(*both, strict=True)]),
        ("cost", "rad", [statistics.mean(run.cost_rad or 0.0 for run in side) for side in zip(*both, strict=True)]),
    ):
        theirs, mine = values
        more = {"ratios": node_ratios(both, seeds)} if name == "nodes" else {}
        show(f"repulsion/{planner[0]}/{name}_{cell}", unit, theirs, mine, counts | more | {"base": base[0]})


def node_ratios(both: Iterable[tuple[Outcome, Outcome]], seeds: int) -> list[float | None]:
    """Returns the ratio of nodes of each planner seed; None if a seed has no nodes of ours."""
    out: list[float | None] = []
    for repeat in range(seeds):
        pairs = [(base.nodes, ours.nodes) for base, ours in both if base.repeat == repeat]
        theirs, mine = sum(pair[0] for pair in pairs), sum(pair[1] for pair in pairs)
        out.append(rounded(theirs / mine) if mine else None)
    return out


def show(name: str, unit: str, theirs: float, mine: float, counts: Mapping[str, Any]) -> None:
    """Prints the figure of the planner, with that of the base and their ratio beside it."""
    ratio = theirs / mine if mine else None
    print_figure(name, float(mine), unit, ratio=ratio, ratio_to="base", of_base=rounded(theirs), **counts)


def solved(runs: Iterable[Outcome]) -> int:
    """Returns the number of runs with a plan."""
    return sum(run.cost_rad is not None for run in runs)


if __name__ == "__main__":
    run_script(main)
