"""`mmp plan SOURCE`: plans one instance, checks the plan and prints a summary."""

from __future__ import annotations

import json
from argparse import ArgumentTypeError, Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mmp_cli.arguments import (
    Parser,
    add_retiming,
    add_source,
    add_time_limit,
    check_spared,
    output,
    positive,
    retiming_of,
    setting,
    whole,
)
from mmp_cli.output import complain
from mmp_cli.plan_steps import first_outcome, run_steps
from mmp_cli.visual_outputs import SPAWN, VisualOutputs, add_visual_options, check_visual_outputs
from mmp_env.errors import InvalidInstanceError, MmpError

if TYPE_CHECKING:
    from mmp_cli.instance_source import InstanceSource
    from mmp_cli.outcome import Outcome
    from mmp_env.model.problem import Problem
    from mmp_planners import Planner

PREFERRED, OTHERWISE = "auto", "apf-ecbs"


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser("mmp plan", "Plans one instance, checks the plan and prints a summary.")
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
    add_time_limit(out, "planning")
    help = "end a planner that uses more, in a process of its own; default: no limit"
    out.add_argument("--memory-limit", type=whole, metavar="MB", help=help)
    out.add_argument("--max-velocity", type=positive, metavar="V", help="of all joints [rad/s]; default: 0.8")
    add_retiming(out, "with --execute and --video")
    out.add_argument("--out", type=_plan_file, metavar="FILE", help="write the plan to this file (schema mmp-plan/1)")
    out.add_argument("--execute", action="store_true", help="play the plan through the actuators in MuJoCo")
    add_visual_options(out)
    out.add_argument("--json", action="store_true", help="print the result as one JSON object instead of the summary")
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is planned."""
    if args.planner is None:
        args.planner = default_planner()
    if args.retime is None:
        args.retime = args.execute or args.video is not None
    args.retiming = retiming_of(args)
    with ready(args.planner, _options(args.settings), args.memory_limit) as planner:
        return _run(args, planner)


@contextmanager
def ready(name: str, options: Mapping[str, Any], memory_limit_mb: int | None = None) -> Iterator[Planner]:
    """Makes the planner. If it is from another package, or has a memory limit, it gets a process of its own.

    That process ends with the context. Raises `MmpError`.
    """
    import mmp_planners
    from mmp_planners import registry

    if memory_limit_mb is None and not registry.is_foreign(name):
        yield mmp_planners.make(name, **options)
        return
    from mmp_cli.planner_process import PlannerProcess

    with PlannerProcess(name, options, memory_limit_mb=memory_limit_mb) as planner:
        yield planner


def _run(args: Namespace, planner: Planner) -> int:
    import mmp_planners
    from mmp_cli.execution import check_executable
    from mmp_cli.instance_source import files_read, read_source
    from mmp_env.files.writing import check_writable, left_alone

    source = read_source(args)
    for name, path in _asked(args).items():
        for read in files_read(args):
            check_spared(read, f"--{name}", path)
    if args.out is not None:
        check_writable(args.out)
    check_visual_outputs(args)
    try:
        problem = _problem(source)
    except InvalidInstanceError:
        if args.json:
            result = mmp_planners.PlanResult(status=mmp_planners.Status.INVALID)
            _report(args, first_outcome(args, source.label, result))
        raise
    if args.execute:
        check_executable(problem, args.source)
    with VisualOutputs(args, problem, _title(args, source.label)) as outputs:
        outcome = run_steps(args, planner, source.label, problem, outputs)
    _report(args, outcome)
    for sentence in left_alone(_unwritten(args, outcome)):
        complain(sentence)
    return outcome.exit_code


def _problem(source: InstanceSource) -> Problem:
    """Returns the problem of a source; on a terminal a line says that it is being drawn."""
    from rich.console import Console

    with Console(stderr=True).status("drawing the instance"):
        return source.problem()


def default_planner() -> str:
    """Returns the planner that is used if the user names none."""
    import mmp_planners

    return PREFERRED if PREFERRED in mmp_planners.names() else OTHERWISE


def _options(settings: list[tuple[str, Any]]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in settings:
        if key in out:
            raise MmpError(f"--set gives {key} twice, {out[key]} and {value}; give one")
        out[key] = value
    return out


def _plan_file(text: str) -> str:
    """Returns the name of a plan file; the suffix of an export format is refused."""
    suffix = Path(text).suffix.lower().replace(".yml", ".yaml")
    if suffix not in ("", ".json"):
        from mmp_env.export import FORMATS

        if suffix in FORMATS:
            instead = f"write plan.json, then `mmp export plan.json --to {Path(text).with_suffix(suffix)}`"
            raise ArgumentTypeError(f"'{text}' would be a plan file, which is JSON; {instead}")
    return output(text)


def _title(args: Namespace, label: str) -> str:
    seed = "" if label.endswith(f"/{args.seed}") else f", seed {args.seed}"
    return f"{args.planner} on {label}{seed}"


def _asked(args: Namespace) -> dict[str, str]:
    """Returns option -> file to write."""
    given = {name: getattr(args, name) for name in ("out", "tree", "rerun", "image", "video")}
    return {name: path for name, path in given.items() if path is not None and (name, path) != ("rerun", SPAWN)}


def _unwritten(args: Namespace, outcome: Outcome) -> list[str]:
    """Returns the files that this run should write and has not written."""
    written = {outcome.plan_path, *outcome.shown.values()}
    return [path for path in _asked(args).values() if path not in written]


def _report(args: Namespace, outcome: Outcome) -> None:
    """Prints the summary, or with --json one object, to stdout, and warnings to stderr."""
    if outcome.refuted:
        complain(
            f"THE CHECKER REFUTES THIS PLAN, which {outcome.planner} returned as solved. Do not run it. This is a "
            "fault of the planner: please report it to its authors with the plan file (--out)."
        )
    for sentence in (outcome.message, *outcome.failures, outcome.interruption):
        if sentence is not None:
            complain(sentence)
    if args.json:
        print(json.dumps(outcome.line() | outcome.verdict()))
        return
    from mmp_cli.summary import print_summary

    print_summary(outcome)
