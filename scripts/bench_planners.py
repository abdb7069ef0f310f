"""How well the planners plan: one JSON line per figure.

Each planner runs over each source in a fresh process, one instance after the other, on one core; every plan is checked
with the spheres and with the geoms. Times are over all valid instances, with the time spent for those that were not
solved. The first few instances are planned twice more, in another process: the plan files must be the same.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import statistics
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from figure import print_figure, rounded
from planner_runs import Job, Run, check_job, plan_twice, run_all

from mmp_cli.arguments import setting
from mmp_env import MmpError

SOURCES = ("MultiArmCell-4", "MultiArmCell-6", "MultiArmCell-8", "MultiArmCell-8:panda")
PLANNERS = ("ecbs", "apf-ecbs-nf", "apf-ecbs")
OURS, BASE = "apf-ecbs", "ecbs"
Result = TypeVar("Result")


def main() -> None:
    """Prints all figures, and on stderr a line for each run."""
    args = arguments()
    try:
        jobs = {
            source: [make_job(args, source, planner) for planner in args.planners.split(",")] for source in args.sources
        }
    except MmpError as error:
        sys.exit(f"bench_planners.py: {error}")
    for source, of_source in jobs.items():
        solved: dict[str, dict[str, Run]] = {}
        for job in of_source:
            runs, peak_mb = in_fresh_process(run_all, job)
            if args.runs:
                keep(args.runs, job, runs)
            solved[job.planner] = print_outcome(job, runs)
            print_faults(job, runs)
            print_one(job, "peak_memory", round(peak_mb), "MB")
            if args.twice:
                print_differences(job, runs[: args.twice])
        if OURS in solved and BASE in solved:
            print_comparison(source, solved)


def make_job(args: argparse.Namespace, source: str, planner: str) -> Job:
    """One planner on one source. Raises `MmpError`."""
    job = Job(
        source=source,
        planner=planner,
        seed=args.seed,
        count=args.count,
        limit_s=args.time_limit,
        options=dict(args.settings),
        exact=not args.no_exact,
    )
    check_job(job)
    return job


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "sources",
        nargs="*",
        default=SOURCES,
        metavar="SOURCE",
        help=f"environment id, id:robot, or instance file (default: {' '.join(SOURCES)})",
    )
    parser.add_argument("--planners", default=",".join(PLANNERS), metavar="A,B", help="default: %(default)s")
    parser.add_argument("--count", type=int, metavar="N", help="instances (default: 50 of an id, all of a file)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="the first one (default: 0)")
    parser.add_argument("--time-limit", type=float, metavar="S", help="default: 5 s up to four arms, 10 s beyond")
    parser.add_argument(
        "--twice", type=int, default=5, metavar="N", help="instances that are planned again (default: 5)"
    )
    parser.add_argument("--no-exact", action="store_true", help="check with the spheres alone")
    parser.add_argument("--runs", type=Path, metavar="FILE", help="add a JSON line per run to this file")
    parser.add_argument(
        "--set", action="append", type=setting, default=[], dest="settings", metavar="KEY=VALUE", help="of all planners"
    )
    return parser.parse_args()


def in_fresh_process(work: Callable[[Job], Result], job: Job) -> Result:
    """The result of `work` in a process that has done nothing else."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        return pool.submit(work, job).result()


def keep(path: Path, job: Job, runs: Sequence[Run]) -> None:
    """Adds the runs to a file, a JSON line each."""
    with path.open("a", encoding="utf-8") as file:
        for run in runs:
            file.write(json.dumps({"source": job.name, "planner": job.planner, **dataclasses.asdict(run)}) + "\n")


def print_one(job: Job, figure: str, value: float, unit: str, **more: Any) -> None:
    """One figure of a planner on a source."""
    planner = " ".join([job.planner, *(f"{key}={value}" for key, value in sorted(job.options.items()))])
    print_figure(f"{job.name}/{planner}/{figure}", value, unit, **more)


def print_outcome(job: Job, runs: Sequence[Run]) -> dict[str, Run]:
    """How many were solved, how fast and how well; returns the solved runs by instance."""
    valid = [run for run in runs if run.time_s is not None]
    print_one(job, "valid_instances", len(valid), f"of {len(runs)}")
    if not valid:
        return {}
    solved = {run.instance: run for run in valid if run.status == "solved"}
    failed = {run.instance: run.status for run in valid if run.status != "solved"}
    share = len(solved) / len(valid)
    print_one(job, "solved", len(solved), f"of {len(valid)}", ratio=share, ratio_to="valid instances", failed=failed)
    times = [run.time_s for run in valid if run.time_s is not None]
    for name, value in (("median", np.median(times)), ("p90", np.percentile(times, 90)), ("max", max(times))):
        print_one(job, f"planning_time_{name}", float(value), "s")
    nodes = [run.nodes for run in solved.values() if run.nodes is not None]
    ratios = [run.cost_ratio for run in solved.values() if run.cost_ratio is not None]
    if nodes:
        print_one(job, "expanded_nodes_median", float(np.median(nodes)), "nodes")
        print_one(job, "expanded_nodes_mean", statistics.mean(nodes), "nodes")
    if ratios:
        p90 = rounded(float(np.percentile(ratios, 90)))
        print_one(job, "cost_median", float(np.median(ratios)), "x the straight lines", p90=p90)
    return solved


def print_faults(job: Job, runs: Sequence[Run]) -> None:
    """Plans that a check refutes; there must be none."""
    wrong = [run.instance for run in runs if run.faults]
    print_one(job, "plans_failing_check", len(wrong), "plans", failed=wrong)
    if job.exact:
        wrong = [run.instance for run in runs if run.exact_faults]
        print_one(job, "plans_failing_exact_check", len(wrong), "plans", failed=wrong)


def print_differences(job: Job, runs: Sequence[Run]) -> None:
    """Plan files that differ from another run with the same seed; one that the deadline cut short may."""
    again = in_fresh_process(plan_twice, dataclasses.replace(job, count=len(runs)))
    compared = [(run, rest) for run, rest in zip(runs, again, strict=True) if run.digest and not run.deadline_hit]
    different = [run.instance for run, (second, third) in compared if not run.digest == second == third]
    print_one(job, "plan_files_that_differ", len(different), f"of {len(compared)}", failed=different)


def print_comparison(source: str, solved: dict[str, dict[str, Run]]) -> None:
    """Mean of expanded nodes on the instances that both planners solve."""
    both = [name for name in solved[OURS] if name in solved[BASE]]
    ours, base = (sum(solved[planner][name].nodes or 0 for name in both) for planner in (OURS, BASE))
    if not both:
        print(f"{source}: no instance was solved by both {OURS} and {BASE}", file=sys.stderr)
        return
    print_one(
        Job(source=source, planner=BASE),
        "expanded_nodes_where_both_solve",
        base / len(both),
        "nodes",
        ratio=base / max(ours, 1),
        ratio_to=OURS,
        instances=len(both),
    )


if __name__ == "__main__":
    main()
