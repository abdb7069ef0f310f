"""`mmp export PLAN --to FILE`: a plan in another format, by the suffix of the file."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mmp_cli.arguments import Parser
from mmp_cli.main import one_line

if TYPE_CHECKING:
    from mmp_env.export.motion import Motion
    from mmp_env.plan import Plan
    from mmp_env.reading import Place

EPISODE_SCHEMA = "mmp-episode/1"


def parser() -> Parser:
    """The arguments of the command."""
    from mmp_env.export import FORMATS, JOINT_NAMES
    from mmp_env.export.joint_names import PLACEHOLDERS

    out = Parser("export", "Writes a plan in another format. Exit 1: written, but the checker refutes the plan.")
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
        help=f"what joints are called in tables and trajectories, of {fields}; default: {JOINT_NAMES}",
    )
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is written."""
    from mmp_env.export import check_target, export_plan
    from mmp_env.plan_file import plan_from_dict

    check_target(args.to)
    documents = _documents(args.plan)
    plans = [plan_from_dict(data, place) for place, data in documents.items()]
    written = export_plan(plans, args.to, joint_names=args.joint_names)
    for path, motion in written.items():
        print(f"{path}: {_content(path, plans[0], motion)}")
    refuted = [place for place, data in documents.items() if not _holds(data, place)]
    return 1 if refuted else 0


def _documents(path: str) -> dict[Place, Any]:
    """Where a file has a plan -> the plan's data; an episode has several. Raises `MmpError`."""
    from mmp_env.errors import MmpError
    from mmp_env.reading import Place, read_document

    data, place = read_document(path), Place(path)
    if not isinstance(data, dict) or data.get("schema") != EPISODE_SCHEMA:
        return {place: data}
    plans = data.get("plans")
    if not isinstance(plans, list) or not plans:
        raise MmpError(f"{place / 'plans'} must be a list of plans, of one at least")
    return {place / "plans" / k: plan for k, plan in enumerate(plans)}


def _holds(data: Any, place: Place) -> bool:
    """Whether the checker confirms a plan. What leaves this program may well move real arms: a refusal is loud."""
    from mmp_env.check import check_plan

    report = check_plan(data)
    if not report.valid:
        first = one_line(str(report.violations[0]))
        print(f"mmp: THE CHECKER REFUTES {one_line(str(place))}: {first}. Do not run it.", file=sys.stderr)
    return report.valid


def _content(path: Path, plan: Plan, motion: Motion) -> str:
    if path.suffix == ".xml":
        return f"{len(plan.problem.cell.arms)} arms, keyframes start and goal"
    retimed = plan.velocities is not None
    fields = "positions, velocities and accelerations" if retimed else "positions only, the plan is not retimed"
    return f"{len(motion.joints)} joints at {len(motion.times)} times, {motion.times[-1]:.1f} s; {fields}"
