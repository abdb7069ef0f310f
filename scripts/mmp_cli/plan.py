"""`mmp plan SOURCE`: plans one instance, checks the plan and prints a summary."""

from __future__ import annotations

import json
import sys
import time
from argparse import Namespace
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mmp_cli.arguments import Parser, add_source, seconds, setting
from mmp_cli.main import one_line
from mmp_env.errors import InvalidInstanceError, MmpError

if TYPE_CHECKING:
    from mmp_cli.outcome import Outcome
    from mmp_env.execution import ExecutionReport
    from mmp_env.plan import Plan
    from mmp_env.problem import Problem
    from mmp_planners import Planner, PlanResult

PREFERRED, OTHERWISE = "auto", "apf-ecbs"
DEFAULT_TIME_LIMIT_S = 60.0


def parser() -> Parser:
    """The arguments of the command."""
    out = Parser("plan", "Plans one instance, checks the plan and prints a summary.")
    add_source(out)
    help = f"default: {PREFERRED}, or {OTHERWISE} where that is not installed"
    out.add_argument("--planner", metavar="NAME", help=help)
    out.add_argument(
        "--set",
        action="append",
        type=setting,
        default=[],
        dest="settings",
        metavar="KEY=VALUE",
        help="an option of the planner (see mmp list); may be given several times",
    )
    out.add_argument(
        "--time-limit",
        type=seconds,
        default=DEFAULT_TIME_LIMIT_S,
        metavar="S",
        help=f"for planning [s]; default: {DEFAULT_TIME_LIMIT_S:g}",
    )
    out.add_argument("--out", metavar="FILE", help="write the plan to this file (schema mmp-plan/1)")
    out.add_argument("--execute", action="store_true", help="play the plan through the actuators in MuJoCo")
    out.add_argument("--json", action="store_true", help="print the result as one JSON object instead of the summary")
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is planned."""
    import mmp_planners
    from mmp_cli.outcome import Outcome
    from mmp_cli.source import read_source
    from mmp_env.writing import check_writable

    if args.planner is None:
        args.planner = default_planner()
    planner = mmp_planners.make(args.planner, **_options(args.settings))
    source = read_source(args)
    if args.out is not None:
        check_writable(args.out)
    try:
        problem = source.problem()
    except InvalidInstanceError:
        result = mmp_planners.PlanResult(status=mmp_planners.Status.INVALID)
        outcome = Outcome(instance=source.label, planner=args.planner, seed=args.seed, result=result)
        if args.json:
            _report(args, outcome)
        raise
    outcome = _run_to_the_end(args, planner, source.label, problem)
    _report(args, outcome)
    return outcome.exit_code


def default_planner() -> str:
    """The planner for those who name none."""
    import mmp_planners

    return PREFERRED if PREFERRED in mmp_planners.names() else OTHERWISE


def _options(settings: list[tuple[str, Any]]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in settings:
        if key in out:
            raise MmpError(f"--set gives {key} twice, {out[key]} and {value}; give one")
        out[key] = value
    return out


def _run_to_the_end(args: Namespace, planner: Planner, label: str, problem: Problem) -> Outcome:
    """Plans, writes the plan, checks and executes it. After Ctrl-C the plan so far is written and that is all."""
    from mmp_cli.outcome import Outcome
    from mmp_env.check import check_plan
    from mmp_env.plan_file import plan_to_dict, save_plan

    started = time.perf_counter()
    result, interrupted = _plan(args, planner, problem)
    outcome = Outcome(
        instance=label,
        planner=args.planner,
        seed=args.seed,
        result=result,
        problem=problem,
        planning_time_s=time.perf_counter() - started,
        interrupted=interrupted,
    )
    if result.plan is None:
        return outcome
    if args.out is not None:
        save_plan(result.plan, args.out)
        outcome = replace(outcome, plan_path=args.out)
    if interrupted:
        return outcome
    started = time.perf_counter()
    # The file's content rather than the object: the checker shall read the cell for itself.
    report = check_plan(plan_to_dict(result.plan))
    outcome = replace(outcome, check=report, check_time_s=time.perf_counter() - started)
    return replace(outcome, execution=_execute(problem, result.plan)) if args.execute else outcome


def _plan(args: Namespace, planner: Planner, problem: Problem) -> tuple[PlanResult, bool]:
    """The result, and whether Ctrl-C ended the planning."""
    from rich.console import Console

    from mmp_cli.interrupt import stopping_on_interrupt
    from mmp_cli.progress import ProgressLine
    from mmp_planners.calling import call

    with ProgressLine(args.planner, Console(stderr=True)) as line, stopping_on_interrupt() as interruption:
        watch = interruption.checked(line)
        result = call(args.planner, planner, problem, seed=args.seed, time_limit=args.time_limit, watch=watch)
    return result, interruption.happened


def _execute(problem: Problem, plan: Plan) -> ExecutionReport:
    from mmp_env.env import MultiArmCellEnv

    env = MultiArmCellEnv(cell=problem.cell)
    env.reset(options={"start": problem.start, "goal": problem.goal})
    return env.execute(plan)


def _report(args: Namespace, outcome: Outcome) -> None:
    """The summary, or with --json the one object, on stdout; what must not be missed on stderr."""
    if outcome.refuted:
        print(
            f"mmp: THE CHECKER REFUTES THIS PLAN, which {outcome.planner} returned as solved. Do not run it. This is a "
            "fault of the planner: please report it to its authors with the plan file (--out).",
            file=sys.stderr,
        )
    if outcome.message is not None:
        print(f"mmp: {one_line(outcome.message)}", file=sys.stderr)
    if args.json:
        print(json.dumps(outcome.line() | outcome.verdict(args.execute)))
        return
    from mmp_cli.summary import print_summary

    print_summary(outcome)
