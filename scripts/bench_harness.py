"""Overhead of `mmp bench` per unit, in addition to planning and checking: a JSON line. Usage: bench_harness.py [SOURCE]

One worker runs the units of one source. The overhead is the time from one answer to the next, minus planning and
checking time: writing the last line to disk, drawing the instance, passing messages, and serialising the plan.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from argparse import Namespace
from pathlib import Path

from figure import print_figure, rounded

from mmp_cli.arguments import Parser
from mmp_cli.bench import parser
from mmp_cli.benchmark.folder import ResultsFolder
from mmp_cli.benchmark.job import Job, Result, Unit
from mmp_cli.benchmark.planner_variants import read_variants
from mmp_cli.benchmark.pool import Pool
from mmp_cli.benchmark.settings import settings_of
from mmp_cli.benchmark.sources import read_sources
from mmp_cli.main import run_script

SOURCE, PLANNER, COUNT = "MultiArmCell-8", "apf-ecbs", 30


def main() -> None:
    """Prints the median over the units, without plans saved and with."""
    own = Parser("bench_harness.py", __doc__)
    own.add_argument("source", nargs="?", default=SOURCE, metavar="SOURCE", help=f"default: {SOURCE}")
    source = own.parse().source
    for saving in ((), ("--save-plans",)):
        args = parser().parse([source, "--planners", PLANNER, "--count", str(COUNT), "--time-limit", "10", *saving])
        job = Job(
            variants=read_variants(args.planners, ()),
            sources=read_sources(args),
            time_limit_s=args.time_limit,
            memory_limit_mb=args.memory_limit,
            save_plans=args.save_plans,
        )
        with tempfile.TemporaryDirectory() as folder:
            beside = [1e3 * seconds for seconds in overheads(args, job, Path(folder))]
        name = "harness_overhead_per_unit" + ("_plans_saved" if saving else "")
        worst = rounded(max(beside))
        print_figure(name, statistics.median(beside), "ms", max=worst, units=len(beside), source=source)


def overheads(args: Namespace, job: Job, path: Path) -> list[float]:
    """Returns the overhead of each unit except the first [s]."""
    units = job.units()
    out: list[float] = []
    before = None
    with Pool(job, 1) as pool, ResultsFolder(path, settings_of(args, job), {unit.key for unit in units}) as folder:
        for unit, answer in pool.run(units):
            assert isinstance(unit, Unit)
            assert isinstance(answer, Result)
            now, line = time.perf_counter(), answer.line
            folder.add(unit, answer.line, answer.plan)
            if before is not None:
                out.append(now - before - (line["planning_time_s"] or 0.0) - (line["check_time_s"] or 0.0))
            before = now
    return out


if __name__ == "__main__":
    run_script(main)
