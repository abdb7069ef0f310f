"""`mmp check PLAN...`: checks plan and schedule files, without planner or native core."""

from __future__ import annotations

import json
from argparse import Namespace
from typing import TYPE_CHECKING

from mmp_cli.arguments import Parser
from mmp_env.errors import MmpError
from mmp_env.files.file_kinds import EPISODE, PLAN, SCHEDULE, read_as
from mmp_env.wording import counted

if TYPE_CHECKING:
    from mmp_env.check import CheckReport


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser("mmp check", "Checks plans again. Exit 0: all are valid; 1: one is not; 2: one cannot be read.")
    out.add_argument(
        "plans",
        nargs="+",
        metavar="PLAN",
        help="plan files (schema mmp-plan/1), episodes of them (mmp-episode/1), or schedules (mmp-schedule/1)",
    )
    out.add_argument("--exact", action="store_true", help="with the MuJoCo geoms instead of the spheres")
    out.add_argument("--json", action="store_true", help="print one JSON object per plan")
    return out


def run(args: Namespace) -> int:
    """Checks all plans and returns the highest exit code."""
    return max(_check(path, args) for path in args.plans)


def _check(path: str, args: Namespace) -> int:
    from mmp_cli.output import complain, say
    from mmp_env.check import CheckReport, check_document
    from mmp_env.check.episode import check_episode
    from mmp_env.check.schedule import check_schedule_document
    from mmp_env.files.episode_file import Episode, plans_from_dict
    from mmp_env.work.schedule_file import SCHEDULE_SCHEMA, schedule_from_dict

    try:
        data = read_as(path, (PLAN, EPISODE, SCHEDULE), "`mmp check` takes plans, episodes and schedules")
        if isinstance(data, dict) and data.get("schema") == SCHEDULE_SCHEMA:
            schedule_from_dict(data, path)
            checker = check_schedule_document
        else:
            checker = check_episode if isinstance(plans_from_dict(data, path), Episode) else check_document
    except MmpError as error:
        complain(error)
        return 2
    # Its content, not the plan that was made of it: the checker shall read the cell for itself.
    report = checker(data, exact=args.exact)
    if args.json:
        print(json.dumps({"plan": path, "exact": args.exact} | report.as_dict()))
    elif not report.valid:
        say(f"{path}: {counted(len(report.sentences), 'violation')}", *(f"  {x}" for x in report.sentences))
    elif isinstance(report, CheckReport):
        say(f"{path}: {report}{margins_in_words(report)}")
    else:
        say(f"{path}: valid", *(f"  {x}" for x in str(report).splitlines()))
    if not args.json:
        plans = [report] if isinstance(report, CheckReport) else report.plans
        pairs = dict.fromkeys(pair for plan in plans for pair in plan.not_tested)
        if pairs:
            say(*(f"  not tested  {pair}" for pair in pairs))
    return 0 if report.valid else 1


def margins_in_words(report: CheckReport) -> str:
    """Returns the margins of a valid plan and what was proved of each kind, to follow the words of the report."""
    from mmp_env.model.margins import KIND_WORDS, Margins, millimetres

    if report.spheres == "geoms" or not report.margins_m or not report.proved_m:
        return ""
    proved = [f"{millimetres(m)} mm {KIND_WORDS[kind]}" for kind, m in report.proved_m.items() if m is not None]
    words = f"; margin {Margins(**report.margins_m)}"
    return words + (
        f", proved {', '.join(proved)}" if proved and "clearance at every instant" not in str(report) else ""
    )
