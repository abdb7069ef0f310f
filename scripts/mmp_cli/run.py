"""`mmp run JOBS`: plans all jobs of a cell, each arm in its own time, checks the schedule and prints a summary."""

from __future__ import annotations

import json
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from mmp_cli.arguments import Parser, add_margin, add_time_limit, check_spared, output, positive, seed
from mmp_cli.output import complain, print_rows
from mmp_cli.schedule_outcome import Done, executes, interruption, line, rows
from mmp_env.errors import InvalidInstanceError, MmpError

if TYPE_CHECKING:
    from mmp_cli.interrupt import Interrupts
    from mmp_env.work.jobs import Jobs
    from mmp_env.work.schedule import Schedule
    from mmp_planners import ScheduleResult


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
    from mmp_cli.interrupt import interruptible_steps
    from mmp_env.files.writing import check_writable
    from mmp_env.work.jobs_file import load_jobs

    jobs = load_jobs(args.jobs)
    if args.out is not None:
        check_spared(args.jobs, "--out", args.out)
        check_writable(args.out)
    with interruptible_steps() as interrupts:
        done = _planned(args, jobs, interrupts)
        steps = {"out": _written, "check": _checked, "execute": _executed}
        asked = {"out": args.out is not None, "check": True, "execute": executes(args)}
        for name, step in steps.items() if done.result.schedule is not None else ():
            if asked[name] and (name == "out" or not interrupts.happened):
                done = _after(args, done, interrupts, partial(step, args, done), whole=name == "out")
    _report(args, done)
    return done.exit_code


def _after(
    args: Namespace, done: Done, interrupts: Interrupts, step: Callable[[], Done], *, whole: bool = False
) -> Done:
    """Returns the results after a step, or those before it, marked as interrupted, if Ctrl-C has ended the step."""
    stopped = replace(done, interrupted=True)
    try:
        out = interrupts.run(step, whole=whole) or stopped
    except KeyboardInterrupt as interrupt:
        interrupt.add_note((interruption(args, stopped) or "").partition("; ")[2])
        raise
    return replace(out, interrupted=interrupts.happened)


def _planned(args: Namespace, jobs: Jobs, interrupts: Interrupts) -> Done:
    """Returns the result; Ctrl-C ends the planning with the shortest schedule so far."""
    found: list[Schedule] = []
    began = time.perf_counter()
    try:
        result = interrupts.run(partial(_schedule, args, jobs, found))
    except KeyboardInterrupt as interrupt:  # SIGTERM
        if found and args.out is not None:
            from mmp_env.work.schedule_file import save_schedule

            save_schedule(found[-1], args.out)
            interrupt.add_note(f"{args.out} holds the shortest schedule so far, not checked")
        raise
    if result is not None:
        return Done(jobs=jobs, result=result, interrupted=interrupts.happened)
    so_far = _shortest_so_far(found, time.perf_counter() - began)
    return Done(jobs=jobs, result=so_far, interrupted=True, is_shortest_so_far=True)


def _schedule(args: Namespace, jobs: Jobs, found: list[Schedule]) -> ScheduleResult:
    """Plans all jobs, and appends each schedule that is the shortest so far to `found`."""
    from rich.console import Console

    import mmp_planners
    from mmp_cli.progress import ScheduleLine
    from mmp_env.model.problem import DEFAULT_MAX_VELOCITY

    with ScheduleLine(args.planner, len(jobs.jobs), Console(stderr=True)) as line:

        def watch(schedule: Schedule) -> None:
            found.append(schedule)
            line.show(schedule.makespan_s)

        try:
            return mmp_planners.schedule(
                jobs,
                planner=args.planner,
                seed=args.seed,
                time_limit=args.time_limit,
                max_velocity=DEFAULT_MAX_VELOCITY if args.max_velocity is None else args.max_velocity,
                margin=args.margin,
                max_acceleration=args.max_acceleration,
                max_jerk=args.max_jerk,
                improve=args.improve,
                watch=watch,
            )
        except InvalidInstanceError as error:
            raise InvalidInstanceError(f"{args.jobs}: {error}") from None


def _shortest_so_far(found: Sequence[Schedule], spent_s: float) -> ScheduleResult:
    """Returns the result of a planning that Ctrl-C has ended."""
    from mmp_planners import ScheduleResult, Status

    if not found:
        return ScheduleResult(status=Status.TIMEOUT, stats={"planning_time_s": spent_s})
    first, last = found[0], found[-1]
    makespans = {"first_makespan_s": first.makespan_s, "attempts": None, "makespan_s": last.makespan_s}
    stats = {**first.stats, "planning_time_s": spent_s, **makespans}
    return ScheduleResult(status=Status.SOLVED, schedule=last, stats=stats)


def _written(args: Namespace, done: Done) -> Done:
    from mmp_env.work.schedule_file import save_schedule

    assert done.result.schedule is not None
    try:
        save_schedule(done.result.schedule, args.out)
    except MmpError as error:  # the disk is full, say: the other steps do not need the file
        return done.failed(f"--out: {error}")
    return replace(done, path=args.out)


def _checked(args: Namespace, done: Done) -> Done:
    from mmp_env.check.schedule import check_schedule_document
    from mmp_env.work.schedule_file import schedule_to_dict

    assert done.result.schedule is not None
    started = time.perf_counter()
    # The file's content rather than the object: the checker shall read the schedule for itself.
    report = check_schedule_document(schedule_to_dict(done.result.schedule))
    return replace(done, check=report, check_time_s=time.perf_counter() - started)


def _executed(args: Namespace, done: Done) -> Done:
    from mmp_env.sim.schedule_execution import execute_schedule

    assert done.result.schedule is not None
    try:
        return replace(
            done, execution=execute_schedule(done.result.schedule, delays=args.delays or 0.0, seed=args.seed)
        )
    except MmpError as error:
        return done.failed(f"--execute: {error}")


def _report(args: Namespace, done: Done) -> None:
    """Prints the summary, or with --json one object, to stdout, and what went wrong to stderr."""
    why = None if done.interrupted else done.message
    for sentence in (why, *done.failures, interruption(args, done)):
        if sentence is not None:
            complain(sentence)
    if done.check is not None and not done.check.valid:
        complain("the checker refutes this schedule; do not run it, and please report this fault")
    if args.json:
        print(json.dumps(line(args, done)))
    else:
        print_rows((name, "bold", value) for name, value in rows(args, done))
