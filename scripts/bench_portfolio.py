"""First plans of `auto` beside those of its members alone: JSON lines. Usage: bench_portfolio.py [CELL...] [--count N]

For each cell, `auto` and its members plan the same instances of task `reach` until their first plan with its
certificate. Median and 90th percentile are of processor time; an instance without a plan counts as 10 s. The ratios
are to the best median and to the best 90th percentile of a member. `--limits` adds how many instances `auto` solves
within short times, and mean and median of its cost relative to the straight lines.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import itertools
import time
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from figure import print_figure, rounded

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import InvalidInstanceError, draw_problem, find_cell, load_instances
from mmp_env.files.instance_file import InstanceFile
from mmp_env.model.problem import Problem
from mmp_planners import Planner, make

CELLS = ("ring-4", "ring-8", "ring-8-panda", "shelf-8-panda", "line-16", "line-32", "line-64")
MEMBERS = {"group-rrt": {"shorten": 0, "waits": "kept"}, "rrt-connect": {"shorten": 0}, "apf-ecbs": {}}
MOST_COMPOSITE = 16
"""Number of arms above which composite RRT-Connect alone is left out: it finds nothing within the time limit."""
TIME_LIMIT_S = 10.0
LIMITS_S = (0.1, 0.3, 1.0)


def main() -> None:
    """Prints the figures of each cell."""
    parser = Parser("bench_portfolio.py", __doc__, argparse.RawDescriptionHelpFormatter)
    add_sources(parser, 50)
    parser.add_argument("--limits", action="store_true", help="also plan with short time limits")
    args = parser.parse()
    for name, problems in read_sources(args):
        compare(name, problems)
        for limit in LIMITS_S if args.limits else ():
            within(name, problems, limit)


def add_sources(parser: argparse.ArgumentParser, count: int) -> None:
    """Adds the arguments that say which instances are planned."""
    parser.add_argument("cells", nargs="*", metavar="CELL", help=f"default: {' '.join(CELLS)}")
    parser.add_argument(
        "--instances", action="append", default=[], metavar="FILE", help="the valid instances of a file, instead"
    )
    parser.add_argument("--count", type=whole, default=count, metavar="N", help=f"instances (default: {count})")


def read_sources(args: argparse.Namespace) -> Iterator[tuple[str, list[Problem]]]:
    """Yields the name of each cell or file, and its instances."""
    for name in args.cells or ([] if args.instances else CELLS):
        yield drawn(name, args.count)
    for path in args.instances:
        yield published(path, args.count)


def drawn(name: str, count: int) -> tuple[str, list[Problem]]:
    """Returns the name of a cell, and instances of it."""
    return name, ready(draw_problem(find_cell(name), seed=seed) for seed in range(count))


def published(path: str, count: int) -> tuple[str, list[Problem]]:
    """Returns the name of an instance file, and its first valid instances."""
    file = load_instances(path)
    return file.name, ready(itertools.islice(valid_problems(file), count))


def ready(problems: Iterable[Problem]) -> list[Problem]:
    """Returns the problems, whose slack is known: it is no part of a search."""
    out = list(problems)
    for problem in out:
        _ = problem.slack
    return out


def valid_problems(file: InstanceFile) -> Iterator[Problem]:
    """Yields the problems of the instances that are valid."""
    for instance in file.instances:
        with contextlib.suppress(InvalidInstanceError):
            yield file.problem(instance)


def compare(name: str, problems: Sequence[Problem]) -> None:
    """Prints the first plans of `auto`, and of each member alone."""
    arms = len(problems[0].cell.arms)
    rivals = [member for member in MEMBERS if arms <= MOST_COMPOSITE or member != "rrt-connect"]
    times = {member: first_plans(make(member, **MEMBERS[member]), problems) for member in rivals}
    ours = first_plans(make("auto", rounds=0, waits="kept"), problems)
    for member, seconds in times.items():
        show(f"first_plan_{name}_{member}", seconds)
    best = [min(quantile(seconds, q) for seconds in times.values()) for q in (0.5, 0.9)]
    show(f"first_plan_{name}", ours, best)


def first_plans(planner: Planner, problems: Sequence[Problem]) -> list[float]:
    """Returns the processor time [s] until the first plan of each instance, `TIME_LIMIT_S` without one."""
    out = []
    # Fresh problems, without what other planners have computed.
    problems = ready(dataclasses.replace(problem) for problem in problems)
    # What the first call of a process loads does not count.
    planner.plan(dataclasses.replace(problems[0]), seed=0, time_limit=TIME_LIMIT_S)
    for seed, problem in enumerate(problems):
        begin = time.process_time()
        solved = planner.plan(problem, seed=seed, time_limit=TIME_LIMIT_S).plan is not None
        out.append(time.process_time() - begin if solved else TIME_LIMIT_S)
    return out


def within(name: str, problems: Sequence[Problem], limit: float) -> None:
    """Prints how many instances `auto` solves within a time limit [s], and mean and median of the ratio of cost."""
    plans = [make("auto").plan(problem, seed=k, time_limit=limit).plan for k, problem in enumerate(problems)]
    ratios = [
        plan.cost_rad / problem.cost_lower_bound_rad
        for plan, problem in zip(plans, problems, strict=True)
        if plan is not None
    ]
    mean, median = (rounded(float(of(ratios))) if ratios else None for of in (np.mean, np.median))
    print_figure(
        f"solved_{name}_within_{limit:g}_s", len(ratios), f"of {len(problems)}", cost_mean=mean, cost_median=median
    )


def show(name: str, seconds: Sequence[float], best: Sequence[float] | None = None) -> None:
    """Prints the median, the 90th percentile, and how many instances have a plan, also relative to `best`."""
    median, p90 = quantile(seconds, 0.5), quantile(seconds, 0.9)
    ratio, over = (None, None) if best is None else (median / best[0], rounded(p90 / best[1]))
    print_figure(
        name,
        median,
        "s",
        ratio=ratio,
        ratio_to="the best member",
        ratio_p90=over,
        p90=rounded(p90),
        solved=sum(each < TIME_LIMIT_S for each in seconds),
        instances=len(seconds),
    )


def quantile(seconds: Sequence[float], share: float) -> float:
    """Returns a quantile of times."""
    return float(np.quantile(seconds, share, method="higher"))


if __name__ == "__main__":
    run_script(main)
