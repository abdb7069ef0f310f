"""What retiming costs and gives, and what executing the result comes to: one JSON line per figure.

Usage: bench_retime.py [SOURCE...] [--count 50] [--no-execute]. A source is ENVIRONMENT or ENVIRONMENT:TASK, its
instances are those of the seeds 0, 1, ..., the plans those of `auto`.
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
from mmp_cli.arguments import Parser, whole
from mmp_cli.standalone import environment_id, run_script
from mmp_env.model.plan import Plan
from mmp_env.retime import RetimeReport, retime_with_report
from mmp_env.sim.execution import ExecutionReport, execute_plan
from mmp_env.sim.simulation import Simulation

TIME_LIMIT_S = 60.0
TASKS = ("crossing", "parallel", "pick", "place", "packing")
SOURCES = (*(f"MultiArmCell-{arms}" for arms in (4, 6, 8)), *(f"MultiArmCell-mixed-4:{task}" for task in TASKS))


@dataclass(frozen=True, kw_only=True)
class Ran:
    """One instance: `retimed_s` [s] is processor time, which other work on the machine does not change much."""

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
        print_source(source.replace(":", "_"), [ran for ran in runs if ran is not None], args.count)


def _source(text: str) -> str:
    """An environment id, or one and a task, as an argument."""
    environment_id(text.partition(":")[0])
    return text


def run(source: str, seed: int, *, execute: bool) -> Ran | None:
    """None where the planner finds no plan in time."""
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
    return Ran(
        retiming=retiming,
        retimed_s=spent,
        valid=mmp_env.check_plan(smooth).valid,
        before=played(plan) if execute else None,
        after=played(smooth) if execute else None,
    )


def played(plan: Plan) -> ExecutionReport:
    """The plan executed in a simulation of its own."""
    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)


def print_source(source: str, runs: Sequence[Ran], count: int) -> None:
    """The figures of one source."""
    name = f"retime_{source}"
    of: dict[str, Any] = {"plans": len(runs), "of": count}
    told = [ran.retiming for ran in runs]
    for key, values in (
        ("ratio", [one.ratio for one in told]),
        ("makespan_s", [one.makespan_s for one in told]),
        ("cpu_ms", [1e3 * ran.retimed_s for ran in runs]),
        ("deviation_rad", [one.deviation_rad for one in told]),
        ("stops", [one.stops for one in told]),
    ):
        unit = {"makespan_s": "s", "cpu_ms": "ms", "deviation_rad": "rad"}.get(key, "1")
        print_figure(f"{name}_{key}_median", float(median(values)), unit, **of)
        print_figure(f"{name}_{key}_max", float(max(values)), unit, **of)
    print_figure(f"{name}_valid", sum(ran.valid for ran in runs), "plans", **of)
    for which in ("before", "after"):
        reports = [report for ran in runs if (report := getattr(ran, which)) is not None]
        if reports:
            print_executions(f"{name}_executed_{which}", reports)


def print_executions(name: str, reports: Sequence[ExecutionReport]) -> None:
    """What executions came to, the worst of each."""
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
