"""`mmp bench SOURCE...`: runs many instances with several planners in worker processes, results in a folder."""

from __future__ import annotations

from argparse import Namespace
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from mmp_cli.arguments import Parser, add_margin, add_time_limit, output, seed, whole
from mmp_cli.output import complain, say
from mmp_env.errors import MmpError

if TYPE_CHECKING:
    from mmp_cli.benchmark.folder import ResultsFolder
    from mmp_cli.benchmark.job import Job
    from mmp_cli.benchmark.pool import Pool
    from mmp_cli.benchmark.ray_pool import RayPool

DEFAULT_MEMORY_LIMIT_MB = 4096
DEFAULT_FOLDER = "bench"
_SHOWN_REASONS = 10
_PROGRAM = "mmp bench"
_ABOUT = """Runs many instances with several planners, each run in a worker process with one thread and its own
deadline. A planner that crashes, hangs or exceeds the memory limit causes a result with status error; the other runs
continue. Each run writes a line to OUT/results.jsonl. Started again, an interrupted benchmark continues; more sources,
planners and instances are added. Exit 0: complete; 2: bad usage, or a folder with other settings or other files; 130:
interrupted."""


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser("mmp bench", _ABOUT)
    out.add_argument(
        "sources", nargs="+", metavar="SOURCE", help="environment ids, instance files and cell files (JSON or YAML)"
    )
    _add_planners(out)
    out.add_argument("--count", type=whole, metavar="N", help="instances of each source; default: all of a file, or 50")
    help = "seed of the planners; instance k of an id has seed N + k; default: 0"
    out.add_argument("--seed", type=seed, default=0, metavar="N", help=help)
    out.add_argument("--robot", metavar="NAME", help="robot of environment ids; default: ur5e")
    out.add_argument("--task", metavar="NAME", help="task to draw instances from; default: reach")
    add_margin(out)
    out.add_argument(
        "--out",
        type=output,
        default=DEFAULT_FOLDER,
        metavar="DIR",
        help=f"folder of the results; default: {DEFAULT_FOLDER}",
    )
    out.add_argument("--save-plans", action="store_true", help="keep each plan in OUT/plans")
    out.add_argument("--exact", action="store_true", help="check each plan with the MuJoCo geoms as well")
    _add_workers(out)
    return out


def _add_planners(parser: Parser) -> None:
    """Adds the options for the planners."""
    from mmp_cli.benchmark.planner_variants import planner_setting

    parser.add_argument(
        "--planners", metavar="A,LABEL=B", help="names; a label tells two of the same name apart; default: auto"
    )
    parser.add_argument(
        "--set",
        action="append",
        type=planner_setting,
        default=[],
        dest="settings",
        metavar="[PLANNER.]KEY=VALUE",
        help="an option of one planner, or of all (see mmp list); may be given several times",
    )


def _add_workers(parser: Parser) -> None:
    """Adds the options for workers and limits."""
    parser.add_argument("--workers", type=whole, metavar="N", help="runs at a time; default: one for each core")
    add_time_limit(parser, "each run")
    help = f"for each run; default: {DEFAULT_MEMORY_LIMIT_MB}"
    parser.add_argument("--memory-limit", type=whole, default=DEFAULT_MEMORY_LIMIT_MB, metavar="MB", help=help)
    parser.add_argument("--ray", metavar="ADDRESS", help="run on the Ray cluster there (extra `ray`), such as auto")


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is planned."""
    from mmp_cli.benchmark.folder import ResultsFolder
    from mmp_cli.benchmark.settings import settings_of
    from mmp_cli.benchmark.table import print_table, reasons

    job = _job(args)
    units = job.units()
    folder = ResultsFolder(Path(args.out), settings_of(args, job), {unit.key for unit in units})
    with ExitStack() as stack:
        pool = None
        if not folder.known():
            # Before the settings are written: the next start is bound to them, and to a misspelt option in them.
            pool = stack.enter_context(_pool(args, job))
            _examine(job, pool)
        stack.enter_context(folder)
        if any(unit.key not in folder.lines for unit in units):
            _work(args, job, folder, pool or stack.enter_context(_pool(args, job)))
    lines = [folder.lines[unit.key] for unit in units]
    print_table(list(job.variants), lines)
    sentences = reasons(lines)
    for sentence in sentences[:_SHOWN_REASONS]:
        complain(sentence, program=_PROGRAM)
    if len(sentences) > _SHOWN_REASONS:
        complain(f"{len(sentences) - _SHOWN_REASONS} more reasons are in the results", program=_PROGRAM)
    say(f"results: {folder.results}; the report of them: mmp report {args.out}")
    return 0


def _job(args: Namespace) -> Job:
    from mmp_cli.benchmark.job import MOST_UNITS, Job
    from mmp_cli.benchmark.planner_variants import read_variants
    from mmp_cli.benchmark.sources import read_sources
    from mmp_cli.plan import default_planner

    variants = read_variants(args.planners or default_planner(), args.settings)
    units = (args.count or 0) * len(args.sources) * len(variants)
    if units > MOST_UNITS:
        raise MmpError(f"--count {args.count} makes {units} units; a benchmark has at most {MOST_UNITS}")
    return Job(
        variants=variants,
        sources=read_sources(args),
        time_limit_s=args.time_limit,
        memory_limit_mb=args.memory_limit,
        exact=args.exact,
        save_plans=args.save_plans,
    )


def _pool(args: Namespace, job: Job) -> Pool | RayPool:
    if args.ray is not None:
        from mmp_cli.benchmark.ray_pool import RayPool

        return RayPool(job, args.ray, args.workers)
    from mmp_cli.benchmark import cores
    from mmp_cli.benchmark.pool import Pool

    return Pool(job, args.workers or cores.count())


def _examine(job: Job, pool: Pool | RayPool) -> None:
    """Raises `MmpError` for an option that a planner does not have; a broken planner is only reported."""
    from mmp_cli.benchmark.job import Examination, Verdict

    for task, answer in pool.run([Examination(planner=label) for label in job.variants]):
        if not isinstance(answer, Verdict):
            complain(f"planner {task.planner}: {getattr(answer, 'message', '')}", program=_PROGRAM)
        elif answer.misuse:
            raise MmpError(answer.misuse)
        elif answer.fault:
            complain(f"{answer.fault}; its results will be errors", program=_PROGRAM)


def _work(args: Namespace, job: Job, folder: ResultsFolder, pool: Pool | RayPool) -> None:
    """Runs the units that have no result yet."""
    from rich.console import Console

    from mmp_cli.benchmark.job import Failure, Result, Unit
    from mmp_cli.benchmark.progress import BenchProgress
    from mmp_cli.benchmark.result_line import line_of_failure
    from mmp_cli.machine import load

    units = [unit for unit in job.units() if unit.key not in folder.lines]
    with BenchProgress(units, folder.lines.values(), pool.workers, Console(stderr=True)) as progress:
        for unit, answer in pool.run(units):
            assert isinstance(unit, Unit)
            if isinstance(answer, Failure):
                answer = Result(line=line_of_failure(job, unit, answer))
            assert isinstance(answer, Result)
            folder.add(unit, answer.line | {"workers": pool.workers, "load": load()}, answer.plan)
            progress.done(unit, answer.line)
