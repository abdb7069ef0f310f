"""`mmp run JOBS`: plans all jobs of a cell, each arm in its own time, checks the schedule and prints a summary."""

from __future__ import annotations

import json
import time
from argparse import Namespace
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from mmp_cli.arguments import Parser, add_margin, add_time_limit, check_spared, output, positive, seed
from mmp_cli.output import complain, print_rows
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.wording import counted, in_seconds

if TYPE_CHECKING:
    from mmp_env.check import CheckReport
    from mmp_env.sim.execution import ExecutionReport
    from mmp_env.work.jobs import Jobs
    from mmp_env.work.schedule import Schedule
    from mmp_planners import ScheduleResult


@dataclass(frozen=True, kw_only=True, eq=False)
class Done:
    """The results of one run so far. Missing parts are None."""

    jobs: Jobs
    result: ScheduleResult
    check: CheckReport | None = None
    check_time_s: float | None = None
    execution: ExecutionReport | None = None
    path: str | None = None
    failure: str | None = None

    @property
    def exit_code(self) -> int:
        """0 for a valid schedule, executed without contact if asked; 2 for an output that failed; 1 otherwise."""
        if self.check is None or not self.check.valid:
            return 1
        if self.failure is not None:
            return 2
        return 0 if self.execution is None or (self.execution.reached and not self.execution.contacts) else 1


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser("mmp run", "Plans all jobs of a cell, each arm in its own time, and checks the schedule.")
    out.add_argument("jobs", metavar="JOBS", help="file of jobs (schema mmp-jobs/1), JSON or YAML")
    help = "write the schedule to this file (schema mmp-schedule/1)"
    out.add_argument("--out", type=output, metavar="FILE", help=help)
    help = "plans all arms together where no single arm can go on; default: auto"
    out.add_argument("--planner", default="auto", metavar="NAME", help=help)
    out.add_argument("--seed", type=seed, default=0, metavar="N", help="seed of all random numbers; default: 0")
    add_time_limit(out, "planning")
    help = "go on for S seconds, within the time limit, with other arms and other orders of the jobs, and keep the "
    help += "shortest schedule"
    out.add_argument("--improve", type=positive, default=0.0, metavar="S", help=help)
    add_margin(out)
    out.add_argument("--max-velocity", type=positive, metavar="V", help="of all joints [rad/s]; default: 0.8")
    out.add_argument("--max-acceleration", type=positive, metavar="A", help="[rad/s^2]; default: the robots' own")
    out.add_argument("--max-jerk", type=positive, metavar="J", help="[rad/s^3]; default: the robots' own")
    out.add_argument("--execute", action="store_true", help="play the schedule through the actuators in MuJoCo")
    help = "execute with random delays of up to S seconds for each motion; implies --execute"
    out.add_argument("--delays", type=positive, metavar="S", help=help)
    out.add_argument("--json", action="store_true", help="print the result as one JSON object instead of the summary")
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is planned."""
    import mmp_planners
    from mmp_env.files.writing import check_writable
    from mmp_env.model.problem import DEFAULT_MAX_VELOCITY
    from mmp_env.work.jobs_file import load_jobs
    from mmp_env.work.schedule_file import save_schedule

    jobs = load_jobs(args.jobs)
    if args.out is not None:
        check_spared(args.jobs, "--out", args.out)
        check_writable(args.out)
    found: list[Schedule] = []
    try:
        result = mmp_planners.schedule(
            jobs,
            planner=args.planner,
            seed=args.seed,
            time_limit=args.time_limit,
            max_velocity=DEFAULT_MAX_VELOCITY if args.max_velocity is None else args.max_velocity,
            margin=args.margin,
            max_acceleration=args.max_acceleration,
            max_jerk=args.max_jerk,
            improve=args.improve,
            watch=found.append,
        )
    except InvalidInstanceError as error:
        raise InvalidInstanceError(f"{args.jobs}: {error}") from None
    except KeyboardInterrupt as interrupt:
        if found and args.out is not None:
            save_schedule(found[-1], args.out)
            interrupt.add_note(f"{args.out} holds the shortest schedule so far, not checked")
        raise
    done = Done(jobs=jobs, result=result)
    if result.schedule is not None:
        done = _executed(args, _checked(_written(args, done)))
    _report(args, done)
    return done.exit_code


def _written(args: Namespace, done: Done) -> Done:
    from mmp_env.work.schedule_file import save_schedule

    if args.out is None or done.result.schedule is None:
        return done
    try:
        save_schedule(done.result.schedule, args.out)
    except MmpError as error:  # the disk is full, say: the other steps do not need the file
        return replace(done, failure=f"--out: {error}")
    return replace(done, path=args.out)


def _checked(done: Done) -> Done:
    from mmp_env.check.schedule import check_schedule_document
    from mmp_env.work.schedule_file import schedule_to_dict

    assert done.result.schedule is not None
    started = time.perf_counter()
    # The file's content rather than the object: the checker shall read the schedule for itself.
    report = check_schedule_document(schedule_to_dict(done.result.schedule))
    return replace(done, check=report, check_time_s=time.perf_counter() - started)


def _executed(args: Namespace, done: Done) -> Done:
    if not _executes(args) or done.result.schedule is None:
        return done
    from mmp_env.sim.schedule_execution import execute_schedule

    try:
        return replace(
            done, execution=execute_schedule(done.result.schedule, delays=args.delays or 0.0, seed=args.seed)
        )
    except MmpError as error:
        return replace(done, failure=f"--execute: {error}")


def _executes(args: Namespace) -> bool:
    return args.execute or args.delays is not None


def _report(args: Namespace, done: Done) -> None:
    """Prints the summary, or with --json one object, to stdout, and what went wrong to stderr."""
    for sentence in (done.result.message, done.failure):
        if sentence:
            complain(sentence)
    if done.check is not None and not done.check.valid:
        complain("the checker refutes this schedule; do not run it, and please report this fault")
    if args.json:
        print(json.dumps(_line(args, done)))
    else:
        print_rows((name, "bold", value) for name, value in _rows(args, done))


def _rows(args: Namespace, done: Done) -> list[tuple[str, str]]:
    schedule, stats = done.result.schedule, done.result.stats
    arms = counted(len(done.jobs.cell.arms), "arm")
    rows = [
        ("jobs", f"{done.jobs.name}: {counted(len(done.jobs.jobs), 'job')}, {arms} in cell {done.jobs.cell.name}"),
        ("status", str(done.result.status)),
        (
            "planning",
            f"{in_seconds(stats['planning_time_s'])}, {stats['low_level_calls']} single-arm searches",
        ),
    ]
    if schedule is None:
        return rows
    helped = f"{counted(stats['yields'], 'yield')}, {counted(stats['group_plans'], 'plan')} of all arms together"
    pairs = f"{counted(len(schedule.order), 'pair')} of motions"
    makespan = f"{in_seconds(schedule.makespan_s)}; the steps of the busiest arm take {in_seconds(schedule.busiest_s)}"
    if "attempts" in stats:
        makespan += (
            f"; {in_seconds(stats['first_makespan_s'])} before {counted(stats['attempts'], 'attempt')} to improve it"
        )
    makespan += f"; no schedule takes less than {in_seconds(schedule.lower_bound_s)}"
    rows += [("makespan", makespan), ("help", helped), ("order", pairs)]
    if done.check is not None:
        rows.append(("check", str(done.check)))
    if done.execution is not None:
        delayed = f", each motion delayed by up to {in_seconds(args.delays)}" if args.delays is not None else ""
        rows.append(("execution", _words(done.execution) + delayed))
    return [*rows, *([("schedule", done.path)] if done.path is not None else [])]


def _line(args: Namespace, done: Done) -> dict[str, Any]:
    from mmp_cli.machine import machine, version
    from mmp_cli.outcome import execution_fields
    from mmp_env.files.writing import plain

    schedule, check = done.result.schedule, done.check
    out = {
        "name": done.jobs.name,
        "jobs": len(done.jobs.jobs),
        "planner": args.planner,
        "seed": args.seed,
        "status": str(done.result.status),
        "blocked": list(done.result.blocked),
        "message": done.result.message or None,
        "makespan_s": None if schedule is None else schedule.makespan_s,
        "busiest_s": None if schedule is None else schedule.busiest_s,
        "lower_bound_s": None if schedule is None else schedule.lower_bound_s,
        "order_pairs": None if schedule is None else len(schedule.order),
        **done.result.stats,
        "valid": None if check is None else check.valid,
        "check_time_s": done.check_time_s,
        "margins_proved": None if check is None else check.proved_m,
        "schedule": done.path,
        "version": version(),
        "machine": machine(),
    }
    if _executes(args):
        out["execution"] = None if done.execution is None else execution_fields(done.execution)
        out["delays_s"] = args.delays or 0.0
    return plain(out)


def _words(execution: ExecutionReport) -> str:
    goals = "every goal reached" if execution.reached else "not every goal reached"
    contacts = counted(len(execution.contacts), "contact") if execution.contacts else "no contact"
    error = f"tracking error at most {execution.max_tracking_error_rad:.4f} {execution.unit}"
    torque = f"torque at most {max(load.share for load in execution.loads.values()):.0%} of its rating"
    return f"{goals}, {contacts}, {error}, {torque}, {in_seconds(execution.duration_s)}"
