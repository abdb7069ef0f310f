"""The outcome of one run of `mmp run`: its exit code, sentences, summary and JSON object."""

from __future__ import annotations

import dataclasses
from argparse import Namespace
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mmp_cli.main import INTERRUPTED
from mmp_env.wording import counted, in_seconds

if TYPE_CHECKING:
    from mmp_env.check import CheckReport
    from mmp_env.sim.execution import ExecutionReport
    from mmp_env.work.jobs import Jobs
    from mmp_env.work.schedule import Schedule
    from mmp_planners import ScheduleResult


@dataclass(frozen=True, kw_only=True, eq=False)
class Done:
    """The results of one run so far. Missing parts are None.

    `is_shortest_so_far` says that Ctrl-C has ended the planning, `interrupted` that it has ended any step.
    """

    jobs: Jobs
    result: ScheduleResult
    interrupted: bool = False
    is_shortest_so_far: bool = False
    check: CheckReport | None = None
    check_time_s: float | None = None
    execution: ExecutionReport | None = None
    path: str | None = None
    failures: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 for a valid schedule, executed without contact if asked; 2 for an output that failed; 130 if interrupted;
        1 otherwise.
        """
        if self.interrupted:
            return INTERRUPTED
        if self.check is None or not self.check.valid:
            return 1
        if self.failures:
            return 2
        return 0 if self.execution is None or (self.execution.reached and not self.execution.contacts) else 1

    @property
    def message(self) -> str | None:
        """Why there is no schedule; None if there is one."""
        if self.result.schedule is None and self.interrupted:
            return "the run was interrupted before there was a schedule"
        return self.result.message or None

    def failed(self, sentence: str) -> Done:
        """Returns these results with one more failure."""
        return dataclasses.replace(self, failures=(*self.failures, sentence))


def executes(args: Namespace) -> bool:
    """Returns whether the schedule is to be executed."""
    return args.execute or args.delays is not None


def interruption(args: Namespace, done: Done) -> str | None:
    """Returns a sentence on what Ctrl-C has left: the schedule file and the steps it lacks. None if there was none."""
    if not done.interrupted:
        return None
    if done.path is None:
        return "interrupted; no schedule file was written" if args.out is not None else "interrupted"
    lacking = {"checked": done.check is None, "executed": executes(args) and done.execution is None}
    words = [f"not {word}" for word, is_lacking in lacking.items() if is_lacking]
    what = "the shortest schedule so far" if done.is_shortest_so_far else "the schedule"
    return f"interrupted; {done.path} holds {what}, {', '.join(words) or 'checked'}"


def rows(args: Namespace, done: Done) -> Iterator[tuple[str, str]]:
    """Yields the rows of the summary."""
    schedule, stats = done.result.schedule, done.result.stats
    arms = counted(len(done.jobs.cell.arms), "arm")
    yield "jobs", f"{done.jobs.name}: {counted(len(done.jobs.jobs), 'job')}, {arms} in cell {done.jobs.cell.name}"
    yield "status", ("interrupted; " if done.interrupted else "") + str(done.result.status)
    searches = f", {stats['low_level_calls']} single-arm searches" if "low_level_calls" in stats else ""
    yield "planning", in_seconds(stats["planning_time_s"]) + searches
    if schedule is not None:
        yield "makespan", _makespan(schedule, stats)
        groups = counted(stats["group_plans"], "plan")
        yield "help", f"{counted(stats['yields'], 'yield')}, {groups} of all arms together"
        yield "order", f"{counted(len(schedule.order), 'pair')} of motions"
    if done.check is not None:
        yield "check", str(done.check)
    elif schedule is not None:
        yield "check", "left out, the run was interrupted"
    if done.execution is not None:
        delayed = f", each motion delayed by up to {in_seconds(args.delays)}" if args.delays is not None else ""
        yield "execution", _words(done.execution) + delayed
    elif executes(args) and done.interrupted:
        yield "execution", f"not done: {'there is no schedule' if schedule is None else 'the run was interrupted'}"
    if done.path is not None:
        yield "schedule", done.path


def _makespan(schedule: Schedule, stats: Mapping[str, Any]) -> str:
    out = f"{in_seconds(schedule.makespan_s)}; the steps of the busiest arm take {in_seconds(schedule.busiest_s)}"
    if "first_makespan_s" in stats:
        attempts = stats["attempts"]
        tries = "attempts" if attempts is None else counted(attempts, "attempt")
        out += f"; {in_seconds(stats['first_makespan_s'])} before {tries} to improve it"
    return f"{out}; no schedule takes less than {in_seconds(schedule.lower_bound_s)}"


def line(args: Namespace, done: Done) -> dict[str, Any]:
    """Returns the JSON object."""
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
        "message": done.message,
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
    if executes(args):
        out["execution"] = None if done.execution is None else execution_fields(done.execution)
        out["delays_s"] = args.delays or 0.0
    return plain(out)


def _words(execution: ExecutionReport) -> str:
    goals = "every goal reached" if execution.reached else "not every goal reached"
    contacts = counted(len(execution.contacts), "contact") if execution.contacts else "no contact"
    error = f"tracking error at most {execution.max_tracking_error_rad:.4f} {execution.unit}"
    torque = f"torque at most {max(load.share for load in execution.loads.values()):.0%} of its rating"
    return f"{goals}, {contacts}, {error}, {torque}, {in_seconds(execution.duration_s)}"
