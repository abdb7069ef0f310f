"""How well the planners plan: one JSON line per figure.

A row is PLANNERS@SOURCES or PLANNERS@SOURCES@SECONDS, such as 'ecbs,apf-ecbs w=1.2@MultiArmCell-8:panda,my.json@10':
planners with their options, environment ids (a robot after the colon) or instance files, and a time limit, by default
5 s up to four arms and 10 s beyond. The default rows are the figures that the planners are to reach; for those with
published instances, panda-circle-N, --instances says in which folder they are.

Each planner runs over each source in a fresh process, one instance after the other, in one thread; every plan is
checked with the spheres and with the geoms. Times are over all valid instances, with the time spent for those that were
not solved. The first few instances are planned twice more, in another process: the plan files must be the same.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import os
import statistics
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from figure import print_figure, rounded
from planner_runs import Job, Run, check_job, plan_twice, run_all

from mmp_cli.arguments import Parser, seed, setting, whole, whole_or_zero
from mmp_cli.standalone import run_script
from mmp_env import MmpError

_RINGS = "MultiArmCell-4,MultiArmCell-6,MultiArmCell-8"
_FILES = "panda-circle-2,panda-circle-4,panda-circle-6"
ROWS = (
    f"rrt-connect@{_RINGS},panda-circle-4@10",
    f"prioritized@{_FILES},{_RINGS}@10",
    f"auto@{_RINGS},panda-circle-4,panda-circle-6@10",
    "auto@MultiArmCell-8:panda@30",
    "prioritized shorten=1000@panda-circle-4,panda-circle-6@10",
    f"cbs,ecbs,gen-ecbs,apf-ecbs-nf,apf-ecbs,cbs-mp,xecbs@{_RINGS}",
    f"ecbs,apf-ecbs-nf,apf-ecbs@MultiArmCell-8:panda,{_FILES}",
)
OURS, BASE = "apf-ecbs", "ecbs"
PUBLISHED = "XECBS"
"""The planner of a published table that costs are compared with."""
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "BLIS")}
Result = TypeVar("Result")


def main() -> None:
    """Prints all figures, and on stderr a line for each run."""
    args = arguments()
    os.environ |= ONE_THREAD  # for the processes to come: what this one has loaded has read them already
    jobs = [job for row in args.rows for job in read_row(args, row)]
    published = {Path(file).name.partition(".")[0]: published_costs(file) for file in args.published}
    solved: dict[str, dict[str, dict[str, Run]]] = {}
    for job in jobs:
        runs, peak_mb = in_fresh_process(run_all, job)
        if args.runs:
            keep(args.runs, job, runs)
        of_source = solved.setdefault(job.source, {})
        of_source[job.label] = print_outcome(job, runs)
        print_faults(job, runs)
        print_one(job, "peak_memory", round(peak_mb), "MB")
        if args.twice:
            print_differences(job, runs[: args.twice])
        if job.name in published:
            print_published(job, of_source[job.label], published[job.name])
        if job.label in (OURS, BASE) and {OURS, BASE} <= of_source.keys():
            print_comparison(job.source, of_source)


def read_row(args: argparse.Namespace, row: str) -> Iterator[Job]:
    """The jobs of a row, source by source. Raises `MmpError`."""
    planners, _, rest = row.partition("@")
    sources, _, limit = rest.partition("@")
    try:
        limit_s = float(limit) if limit else None
    except ValueError:
        raise MmpError(f"row '{row}' has the time limit '{limit}'; it must be a number of seconds") from None
    if not sources:
        raise MmpError(f"row '{row}' names no source; it must be PLANNERS@SOURCES or PLANNERS@SOURCES@SECONDS")
    for source in sources.split(","):
        path = find_source(args, source)
        if path is None:
            print(f"left out, for --instances is not given: {planners} on {source}", file=sys.stderr)
            continue
        for words in planners.split(","):
            yield make_job(args, path, words, limit_s)


def find_source(args: argparse.Namespace, source: str) -> str | None:
    """The environment id or the path of a file; None for a published one whose folder is not known."""
    if source.endswith(".json") or not source.startswith("panda-circle-"):
        return source
    return str(args.instances / f"{source}.json") if args.instances else None


def make_job(args: argparse.Namespace, source: str, words: str, limit_s: float | None) -> Job:
    """One planner, `words` being its name and options, on one source. Raises `MmpError`."""
    planner, *options = words.split()
    try:
        settings = dict(setting(option) for option in options)
    except argparse.ArgumentTypeError as error:
        raise MmpError(f"planner '{words}': {error}") from None
    job = Job(
        source=source,
        planner=planner,
        seed=args.seed,
        count=args.count,
        limit_s=limit_s,
        options=settings,
        exact=not args.no_exact,
    )
    check_job(job)
    return job


def published_costs(file: str) -> dict[str, float]:
    """Instance -> cost [rad] of those that the published planner solved. Raises `MmpError`."""
    try:
        with open(file, encoding="utf-8", newline="") as lines:
            rows = [row for row in csv.DictReader(lines) if row["planner"].upper() == PUBLISHED]
        return {row["instance"]: float(row["cost_rad"]) for row in rows if row["solved"] == "1"}
    except OSError as error:
        raise MmpError(f"{file} cannot be read: {error.strerror}") from None
    except (KeyError, ValueError) as error:
        raise MmpError(f"{file} has no such column or number: {error}") from None


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = Parser("bench_planners.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", nargs="*", default=ROWS, metavar="ROW", help="default: " + "; ".join(ROWS))
    parser.add_argument("--instances", type=Path, metavar="DIR", help="folder of panda-circle-N.json")
    parser.add_argument(
        "--published",
        nargs="+",
        default=[],
        metavar="CSV",
        help=f"published results of SOURCE, SOURCE.*.csv: costs are compared with those of {PUBLISHED}",
    )
    parser.add_argument("--count", type=whole, metavar="N", help="instances (default: 50 of an id, all of a file)")
    parser.add_argument("--seed", type=seed, default=0, metavar="N", help="the first one (default: 0)")
    parser.add_argument(
        "--twice", type=whole_or_zero, default=5, metavar="N", help="instances that are planned again (default: 5)"
    )
    parser.add_argument("--no-exact", action="store_true", help="check with the spheres alone")
    parser.add_argument("--runs", type=Path, metavar="FILE", help="add a JSON line per run to this file")
    return parser.parse()


def in_fresh_process(work: Callable[[Job], Result], job: Job) -> Result:
    """The result of `work` in a process that has done nothing else."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        return pool.submit(work, job).result()


def keep(path: Path, job: Job, runs: Sequence[Run]) -> None:
    """Adds the runs to a file, a JSON line each."""
    with path.open("a", encoding="utf-8") as file:
        for run in runs:
            file.write(json.dumps({"source": job.name, "planner": job.label, **dataclasses.asdict(run)}) + "\n")


def print_one(job: Job, figure: str, value: float, unit: str, **more: Any) -> None:
    """One figure of a planner on a source."""
    print_figure(f"{job.name}/{job.label}/{figure}", value, unit, **more)


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
    firsts = [run.first_s for run in solved.values() if run.first_s is not None]
    if firsts:
        print_one(job, "first_plan_median", float(np.median(firsts)), "s")
    nodes = [run.nodes for run in solved.values() if run.nodes is not None]
    ratios = [run.cost_ratio for run in solved.values() if run.cost_ratio is not None]
    if nodes:
        print_one(job, "expanded_nodes_median", float(np.median(nodes)), "nodes")
        print_one(job, "expanded_nodes_mean", statistics.mean(nodes), "nodes")
    if ratios:
        p90 = rounded(float(np.percentile(ratios, 90)))
        print_one(job, "cost_median", float(np.median(ratios)), "x the straight lines", p90=p90)
        print_one(job, "cost_mean", statistics.mean(ratios), "x the straight lines")
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


def print_published(job: Job, solved: dict[str, Run], published: dict[str, float]) -> None:
    """Mean cost on the instances that the published planner solved as well, and theirs."""
    both = {name: run.cost_rad for name, run in solved.items() if name in published and run.cost_rad is not None}
    if both:
        ours, theirs = statistics.mean(both.values()), statistics.mean(published[name] for name in both)
        more = {"ratio": ours / theirs, "ratio_to": f"published {PUBLISHED}", "instances": len(both)}
        print_one(job, "cost_mean_beside_published", ours, "rad", **more)


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
    run_script(main)
