"""`mmp export PLAN --to FILE`: a plan in another format, by the suffix of the file."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from mmp_cli.arguments import Parser, add_retiming, check_spared, retiming_of
from mmp_cli.output import complain, say
from mmp_env.files.file_kinds import EPISODE, PLAN, check_replaceable, read_as
from mmp_env.wording import in_seconds

if TYPE_CHECKING:
    from mmp_env.export.motion import Motion
    from mmp_env.model.plan import Plan


def parser() -> Parser:
    """Returns the parser of the command."""
    from mmp_env.export import FORMATS, JOINT_NAMES
    from mmp_env.export.joint_names import PLACEHOLDERS

    out = Parser("mmp export", "Writes a plan in another format. Exit 1: written, but the checker refutes the plan.")
    out.add_argument("plan", metavar="PLAN", help="plan file (schema mmp-plan/1), or episode (mmp-episode/1)")
    formats = "; ".join(f"{suffix}: {what}" for suffix, what in FORMATS.items())
    out.add_argument(
        "--to", required=True, metavar="FILE", help=f"{formats}. With {{arm}} in the name, a file for each arm"
    )
    fields = ", ".join(f"{{{field}}}" for field in PLACEHOLDERS)
    out.add_argument(
        "--joint-names",
        default=JOINT_NAMES,
        metavar="PATTERN",
        help=f"names of joints in tables and trajectories, from {fields}; default: {JOINT_NAMES}",
    )
    add_retiming(out, "plans that are not retimed")
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is written."""
    from mmp_env.check import check_document
    from mmp_env.check.episode import check_episode
    from mmp_env.export import check_target, export_plan
    from mmp_env.export.formats import of_arm
    from mmp_env.files.episode_file import Episode, plans_from_dict
    from mmp_env.files.plan_check import check_plan

    check_target(args.to)
    data = read_as(args.plan, (PLAN, EPISODE), "`mmp export` takes plans and episodes")
    read = plans_from_dict(data, args.plan)
    in_a_row = isinstance(read, Episode)
    plans = list(read.plans) if in_a_row else [read]
    for target in dict.fromkeys(of_arm(args.to, arm) for arm in plans[0].problem.cell.arm_names):
        check_spared(args.plan, "--to", target)
        check_replaceable(target, "--to")
    report, refuted = (check_episode if in_a_row else check_document)(data), args.plan
    if is_retimed := report.valid:
        read_plans, plans = plans, _ready_to_run(args, plans)
        is_retimed = args.retime
        for number, (plan, before) in enumerate(zip(plans, read_plans, strict=True), start=1):
            if report.valid and plan is not before:
                report = check_plan(plan)
                refuted = f"THE RETIMED PLAN{f' {number}' if in_a_row else ''} OF {args.plan}"
    written = export_plan(plans, args.to, joint_names=args.joint_names)
    if is_retimed:
        say("retimed for the file; --no-retime writes the plan as it is")
    for path, motion in written.items():
        say(f"{path}: {_content(path, plans[0], motion)}")
    if not report.valid:
        # The exported file may move real arms, so this message is loud.
        complain(f"THE CHECKER REFUTES {refuted}: {report.sentences[0]}. Do not run it.")
    return 0 if report.valid else 1


def _ready_to_run(args: Namespace, plans: list[Plan]) -> list[Plan]:
    """Returns the plans, retimed for a file with a motion unless that is declined. Raises `MmpError`."""
    from mmp_env.retime import retime

    is_motion = Path(args.to).suffix.lower() != ".xml"
    if args.retime is None:
        args.retime = is_motion and not all(plan.retimed for plan in plans)
    options = retiming_of(args)
    if not args.retime:
        return plans
    return [plan if plan.retimed and not options else retime(plan, **options) for plan in plans]


def _content(path: Path, plan: Plan, motion: Motion) -> str:
    if path.suffix == ".xml":
        return f"{len(plan.problem.cell.arms)} arms, keyframes start and goal"
    fields = "positions, velocities and accelerations" if plan.retimed else "positions only, the plan is not retimed"
    return f"{len(motion.joints)} joints at {len(motion.times)} times, {in_seconds(motion.times[-1], 1)}; {fields}"
