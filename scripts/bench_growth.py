"""Growth of time and memory with the number of arms at constant density: a JSON line per figure.

Usage: bench_growth.py [--arms 8 16 32 64] [--count 20]. Every size is a line cell in a process of its own, with one
thread. A time is the median processor time over instances of task `reach`: the first plan of `auto`, the removal of
its waits, its certificate, its check, as the first one of the cell and once more, its retiming, the check of the
retimed plan, and the summary of `mmp plan`. An exponent is the slope of a straight line through the logarithms of arms
and times.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import resource
import subprocess
import sys
import time
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from statistics import median
from typing import Any, TypeVar

import numpy as np
from figure import print_figure

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_cli.plan_steps import first_outcome
from mmp_cli.summary import print_summary
from mmp_env import core, draw_problem, find_cell
from mmp_env.check import check_document
from mmp_env.errors import MmpError
from mmp_env.files.plan_file import plan_to_check
from mmp_env.model.certificate import certify
from mmp_env.retime import retime_with_report
from mmp_planners import make
from mmp_planners.portfolio.wait_removal import without_waits

ARMS = (8, 16, 32, 64)
STEPS = ("first_plan", "wait_removal", "certificate", "first_check", "check", "retiming", "retimed_check", "summary")
TIME_LIMIT_S = 60.0
T = TypeVar("T")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
ASKED = Namespace(planner="auto", seed=0, margin=None, retime=True, out=None, execute=False)
"""Arguments of `mmp plan` that the summary shows."""


def main() -> None:
    """Prints the figures of each size, and the exponents."""
    parser = Parser("bench_growth.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", nargs="+", type=whole, default=ARMS, metavar="N", help="default: 8 16 32 64")
    parser.add_argument("--count", type=whole, default=20, metavar="N", help="instances of each size (default: 20)")
    parser.add_argument("--here", action="store_true", help="print the raw numbers of one size, in this process")
    args = parser.parse()
    if args.here:
        print(json.dumps(measured(args.arms[0], args.count)))
        return
    sizes = {arms: in_process(arms, args.count) for arms in args.arms}
    for arms, found in sizes.items():
        of = {"arms": arms, "instances": args.count, "solved": found["solved"]}
        for step in STEPS:
            print_figure(f"growth_{step}_line-{arms}", found[step], "s", **of)
        print_figure(f"growth_memory_line-{arms}", found["memory"], "MB", **of)
    if len(sizes) > 1:
        for step in (*STEPS, "memory"):
            slope = exponent(list(sizes), [found[step] for found in sizes.values()])
            print_figure(f"growth_{step}_exponent", slope, "1", arms=list(sizes))


def in_process(arms: int, count: int) -> dict[str, Any]:
    """Returns the numbers of one size, measured in a process of its own."""
    command = [sys.executable, __file__, "--here", "--arms", str(arms), "--count", str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | ONE_THREAD)
    if done.returncode:
        raise MmpError(f"the process for {arms} arms ended with exit code {done.returncode}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def measured(arms: int, count: int) -> dict[str, Any]:
    """Returns the median processor times [s] of one size, the solved instances, and the peak memory [MB]."""
    rows = [row for seed in range(count) if (row := measured_instance(arms, seed)) is not None]
    if not rows:
        raise MmpError(f"auto finds no plan for {arms} arms within {TIME_LIMIT_S:g} s")
    out: dict[str, Any] = {step: median(row[step] for row in rows if step in row) for step in STEPS}
    return out | {"solved": len(rows), "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3}


def measured_instance(arms: int, seed: int) -> dict[str, float] | None:
    """Returns the processor time [s] of each step for one instance, or None without a plan."""
    problem = draw_problem(find_cell(f"line-{arms}"), seed=seed)
    _ = problem.slack
    times: dict[str, float] = {}
    planner = make("auto", rounds=0, waits="kept")
    result = spent(times, "first_plan", lambda: planner.plan(problem, seed=seed, time_limit=TIME_LIMIT_S))
    if result.plan is None:
        return None
    found, clock = result.plan, core.Clock(TIME_LIMIT_S)
    plan = spent(times, "wait_removal", lambda: without_waits(found, clock)) or found
    proof = spent(times, "certificate", lambda: certify(plan, clock))
    document = plan_to_check(plan)
    if seed == 0:  # the checker keeps the cells that it has read
        spent(times, "first_check", lambda: check_document(document))
    report = spent(times, "check", lambda: check_document(document))
    if not (proof.valid and report.valid):
        raise MmpError(f"the plan of instance {seed} of {arms} arms is not proved: {report}")
    smooth, retiming = spent(times, "retiming", lambda: retime_with_report(plan))
    report = spent(times, "retimed_check", lambda: check_document(plan_to_check(smooth)))
    outcome = replace(
        first_outcome(ASKED, f"line-{arms}", replace(result, plan=smooth)),
        problem=problem,
        planning_time_s=times["first_plan"],
        check=report,
        check_time_s=times["retimed_check"],
        retimed=retiming,
    )
    with contextlib.redirect_stdout(io.StringIO()):
        spent(times, "summary", lambda: print_summary(outcome))
    return times


def spent(times: dict[str, float], name: str, call: Callable[[], T]) -> T:
    """Returns the result of a call, and notes its processor time [s] under a name."""
    begin = time.process_time()
    out = call()
    times[name] = time.process_time() - begin
    return out


def exponent(arms: list[int], seconds: list[float]) -> float:
    """Returns the exponent of the power of the number of arms that fits the times best."""
    return float(np.polyfit(np.log(arms), np.log(seconds), 1)[0])


if __name__ == "__main__":
    run_script(main)
