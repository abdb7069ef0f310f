"""Time and result of retiming, and of executing retimed plans: a JSON line per figure.

Usage: bench_retime.py [SOURCE...] [--count 50] [--no-execute]. A source is ENVIRONMENT or ENVIRONMENT:TASK. Its
instances are those of the seeds 0, 1, ...; `auto` plans them.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import gymnasium
from figure import print_figure

import mmp_env
import mmp_planners
from mmp_cli.arguments import Parser, environment_id, whole
from mmp_cli.execution import execute as executed
from mmp_cli.main import run_script
from mmp_env.retime import RetimeReport, retime_with_report
from mmp_env.sim.execution import ExecutionReport

TIME_LIMIT_S = 60.0
TASKS = ("crossing", "parallel", "pick", "place", "packing")
SOURCES = (*(f"MultiArmCell-{arms}" for arms in (4, 6, 8)), *(f"MultiArmCell-mixed-4:{task}" for task in TASKS))


@dataclass(frozen=True, kw_only=True)
class RetimedRun:
    """One instance; `retimed_s` is processor time [s], which other work on the machine disturbs little."""

    retiming: RetimeReport
    retimed_s: float
    valid: bool
    before: ExecutionReport | None
    after: ExecutionReport | None


def main() -> None:
    """Prints the figures of all cells."""
    parser = Parser("bench_retime.py", __doc__)
    parser.add_argument("sources", nargs="*", type=_source, default=SOURCES, metavar="SOURCE")
    parser.add_argument("--count", type=whole, default=50)
    parser.add_argument("--no-execute", action="store_true")
    args = parser.parse()
    for source in args.sources:
        runs = [run(source, seed, execute=not args.no_execute) for seed in range(args.count)]
        print_source(source.replace(":", "_"), [done for done in runs if done is not None], args.count)


def _source(text: str) -> str:
    """Returns an environment id, or an id and a task."""
    environment_id(text.partition(":")[0])
    return text


def run(source: str, seed: int, *, execute: bool) -> RetimedRun | None:
    """Returns the result of one instance, or None if the planner finds no plan in time."""
    environment, _, task = source.partition(":")
    options: dict[str, Any] = {"task": task} if task else {}
    env = gymnasium.make(environment, **options)
    env.reset(seed=seed)
    problem = env.unwrapped.problem  # pyright: ignore[reportAttributeAccessIssue]
    plan = mmp_planners.make("auto").plan(problem, seed=seed, time_limit=TIME_LIMIT_S).plan
    if plan is None:
        return None
    begin = time.thread_time()
    smooth, retiming = retime_with_report(plan)
    spent = time.thread_time() - begin
    return RetimedRun(
        retiming=retiming,
        retimed_s=spent,
        valid=mmp_env.check_plan(smooth).valid,
        before=executed(plan) if execute else None,
        after=executed(smooth) if execute else None,
    )


def print_source(source: str, runs: Sequence[RetimedRun], count: int) -> None:
    """Prints the figures of one source."""
    name = f"retime_{source}"
    of: dict[str, Any] = {"plans": len(runs), "of": count}
    reports_of_retiming = [done.retiming for done in runs]
    for key, values in (
        ("ratio", [one.ratio for one in reports_of_retiming]),
        ("makespan_s", [one.makespan_s for one in reports_of_retiming]),
        ("cpu_ms", [1e3 * done.retimed_s for done in runs]),
        ("deviation_rad", [one.deviation_rad for one in reports_of_retiming]),
        ("stops", [one.stops for one in reports_of_retiming]),
    ):
        unit = {"makespan_s": "s", "cpu_ms": "ms", "deviation_rad": "rad"}.get(key, "1")
        print_figure(f"{name}_{key}_median", float(median(values)), unit, **of)
        print_figure(f"{name}_{key}_max", float(max(values)), unit, **of)
    print_figure(f"{name}_valid", sum(done.valid for done in runs), "plans", **of)
    for which in ("before", "after"):
        reports = [report for done in runs if (report := getattr(done, which)) is not None]
        if reports:
            print_executions(f"{name}_executed_{which}", reports)


def print_executions(name: str, reports: Sequence[ExecutionReport]) -> None:
    """Prints the worst values of the executions."""
    of: dict[str, Any] = {"of": len(reports)}
    loads = [load.share for report in reports for load in report.loads.values()]
    print_figure(f"{name}_reached", sum(report.reached for report in reports), "plans", **of)
    print_figure(f"{name}_contacts", sum(len(report.contacts) for report in reports), "contacts", **of)
    print_figure(f"{name}_tracking_max", max(report.max_tracking_error_rad for report in reports), "rad", **of)
    print_figure(f"{name}_torque_share_max", max(loads), "1", **of)
    closer = [report.nearness.closer_m for report in reports]
    print_figure(f"{name}_closer_than_proved", sum(distance > 0 for distance in closer), "plans", **of)
    print_figure(f"{name}_closer_than_proved_max", 1e3 * max(closer), "mm", **of)


if __name__ == "__main__":
    run_script(main)
