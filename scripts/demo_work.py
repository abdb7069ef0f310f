"""Four arms take parts from two feeders and put them into boxes: planned, checked, executed, and compared with rounds.

In rounds all arms begin a motion together, and the next one when all have arrived: the same jobs, arms and limits.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from feeders_to_boxes import feeders_to_boxes

import mmp_env
from mmp_cli.arguments import Parser, output, positive, seconds, seed, whole
from mmp_cli.main import run_script
from mmp_env.check.schedule import check_schedule_document
from mmp_env.files.writing import check_writable
from mmp_env.wording import counted
from mmp_env.work.jobs import Jobs
from mmp_env.work.schedule import Schedule
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import schedule


def main(arguments: Sequence[str] | None = None) -> int:
    """Plans, checks, saves and executes. Returns 0 if the schedule is valid and no contact occurs, 1 otherwise.

    Raises `MmpError` for misuse.
    """
    args = _parser().parse(arguments)
    if args.out:
        check_writable(args.out)
    jobs = feeders_to_boxes(args.seed, args.parts)
    began = time.process_time()
    found = planned(jobs, args.time_limit, rounds=False)
    if found is None:
        return 1
    spent = time.process_time() - began
    picks = sum(event.kind == "grasp" for event in found.events)
    print(f"planning   {spent:.2f} s of processor time, {spent / found.makespan_s:.1%} of the makespan")
    print(f"makespan   {found.makespan_s:.2f} s, {picks / found.makespan_s * 60:.1f} picks per minute")
    if args.out:
        mmp_env.save_schedule(found, args.out)
    report = check_schedule_document(schedule_to_dict(found))
    print(f"check      {report}")
    execution = mmp_env.execute_schedule(found, delays=args.delays or 0.0, seed=args.seed)
    contacts = counted(len(execution.contacts), "contact") if execution.contacts else "no contact"
    reached = "every goal reached" if execution.reached else "NOT every goal reached"
    print(f"execution  {execution.duration_s:.2f} s of simulated time: {reached}, {contacts}")
    rounds = planned(found.assigned, args.time_limit, rounds=True)
    if rounds is not None:
        print(f"in rounds  {rounds.makespan_s:.2f} s; own time / rounds: {found.makespan_s / rounds.makespan_s:.2f}")
    if args.out:
        print(f"schedule   {args.out}")
    return 0 if report.valid and execution.reached and not execution.contacts else 1


def planned(jobs: Jobs, time_limit: float, *, rounds: bool) -> Schedule | None:
    """Returns a schedule; None if there is none in time, and says why."""
    result = schedule(jobs, time_limit=time_limit, rounds=rounds)
    if result.schedule is None:
        print(f"demo_work.py: {result.message}", file=sys.stderr)
    return result.schedule


def _parser() -> Parser:
    out = Parser("demo_work.py", __doc__)
    help = "draws the parts that a camera must see; default: 0"
    out.add_argument("--seed", type=seed, default=0, metavar="N", help=help)
    out.add_argument("--parts", type=whole, default=24, metavar="N", help="number of parts, 24 at most; default: 24")
    help = "for each of the two schedules [s]; default: 300"
    out.add_argument("--time-limit", type=seconds, default=300.0, metavar="S", help=help)
    out.add_argument("--delays", type=positive, metavar="S", help="execute with random delays of up to S seconds")
    out.add_argument("--out", type=output, metavar="FILE", help="write the schedule (schema mmp-schedule/1)")
    return out


if __name__ == "__main__":
    run_script(main)
