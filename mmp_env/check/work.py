"""The rules of jobs: every step is done once, by one arm, in its order, and ends at what was asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.asked import Asked, AskedPose, read_asked
from mmp_env.check.checked import CheckedArm, CheckedCell
from mmp_env.check.fields import UnreadableError, known, listed, member, numbers, positive, shown, text
from mmp_env.check.goals import JOINT_TOLERANCE, POSE_TOLERANCE_M, POSE_TOLERANCE_RAD
from mmp_env.check.lines import off_line, tool_pose
from mmp_env.check.model import CellModel
from mmp_env.check.report import Violation
from mmp_env.check.schedule_motion import Motion

TIME_TOLERANCE_S = 1e-6
"""Tolerance [s] of begins, ends and waits, for the rounding of sums."""
RULES = ("jobs", "events", "goal", "line", "order", "objects", "proof")
"""Rules of schedules beyond those of plans."""
_KINDS = ("move", "line", "grasp", "release", "wait", "yield")


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """A step of a job: its kind, and what it asks for: a goal, a displacement [3] [m], an object, or a time [s]."""

    kind: str
    value: Any


@dataclass(frozen=True, kw_only=True, eq=False)
class Job:
    """A job: `arm` is None if any may do it; `after` names jobs that are done before."""

    name: str
    arm: str | None
    steps: Sequence[Step]
    after: Sequence[str]


@dataclass(frozen=True, kw_only=True, eq=False)
class Event:
    """An event of one arm from `begin` to `end` [s]; `job` and `step` are None if it yields.

    A grasp or release has its object, and the `pose` of that: position [m] and quaternion (wxyz).
    """

    begin: float
    end: float
    arm: str
    kind: str
    job: str | None
    step: int | None
    group: int | None = None
    object: str | None = None
    pose: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """All that the rules need."""

    model: CellModel
    motions: Mapping[str, Motion]
    jobs: Sequence[Job]
    events: Sequence[Event]

    @property
    def cell(self) -> CheckedCell:
        return self.model.cell

    @cached_property
    def _by_arm(self) -> Mapping[str, list[Event]]:
        out: dict[str, list[Event]] = {}
        for event in sorted(self.events, key=lambda e: (e.begin, e.end)):
            out.setdefault(event.arm, []).append(event)
        return out

    def of_arm(self, arm: str) -> list[Event]:
        """Returns the events of an arm in their order."""
        return self._by_arm.get(arm, [])

    def of_job(self, job: str) -> list[Event]:
        """Returns the events of a job in the order of their steps."""
        return sorted((e for e in self.events if e.job == job), key=lambda e: (e.step or 0, e.begin))


def read_jobs(data: Sequence[Any], cell: CheckedCell) -> list[Job]:
    """Returns the jobs. Raises `UnreadableError`."""
    arms = [arm.name for arm in cell.arms]
    jobs = [_job(entry, arms, f"job {k}") for k, entry in enumerate(data)]
    names = [job.name for job in jobs]
    if len(set(names)) < len(names):
        raise UnreadableError("two jobs of the schedule have the same name")
    for job in jobs:
        if strange := [name for name in job.after if name not in names]:
            raise UnreadableError(f"job '{job.name}' comes after {shown(strange[0])}, which is no job")
    return jobs


def read_events(data: Sequence[Any]) -> list[Event]:
    """Returns the events. Raises `UnreadableError`."""
    return [_event(entry, f"event {k}") for k, entry in enumerate(data)]


def broken_rules(work: Work) -> Iterator[Violation]:
    """Yields a violation for every rule of jobs that the schedule breaks."""
    yield from _events(work)
    for job in work.jobs:
        faults = list(_done(work, job))
        yield from faults
        if not faults:
            yield from _steps(work, job)


def _events(work: Work) -> Iterator[Violation]:
    """Events name arms and jobs of the schedule; those of an arm follow each other; outside of them it is at rest."""
    jobs, end = {job.name for job in work.jobs}, max(float(motion.times[-1]) for motion in work.motions.values())
    for event in work.events:
        if event.arm not in work.motions:
            yield _fault("events", f"an event names arm '{event.arm}', which is not in the cell", event)
        if event.job is not None and event.job not in jobs:
            yield _fault("events", f"an event names job '{event.job}', which is not in the schedule", event)
        if not 0 <= event.begin <= event.end <= end + TIME_TOLERANCE_S:
            yield _fault("events", f"an event of arm '{event.arm}' is from {event.begin:g} to {event.end:g} s", event)
    for arm, motion in work.motions.items():
        events, until, job = work.of_arm(arm), 0.0, None
        for event in events:
            if event.begin < until - TIME_TOLERANCE_S:
                yield _fault("events", f"arm '{arm}' does two things at once at {event.begin:g} s", event)
            elif motion.moves(until, event.begin):
                yield _fault("events", f"arm '{arm}' moves before {event.begin:g} s, and no event says why", event)
            until = max(until, event.end)
        if motion.moves(until, max(until, float(motion.times[-1]))):
            yield Violation(
                rule="events",
                message=f"arm '{arm}' moves after {until:g} s, and no event says why",
                time_s=until,
                arms=(arm,),
            )
        for before, event in pairwise([e for e in events if e.job is not None]):
            job = before.job
            if event.job != job and event.step != 0:
                yield _fault("jobs", f"arm '{arm}' does job '{job}' in the middle of job '{event.job}'", event)


def _done(work: Work, job: Job) -> Iterator[Violation]:
    """Every step of a job is done once, in its order, by the arm that was asked for and after what was asked for."""
    events = work.of_job(job.name)
    if [event.step for event in events] != list(range(len(job.steps))):
        done = [event.step for event in events]
        yield _fault("jobs", f"job '{job.name}' has {len(job.steps)} steps; the events have the steps {done}")
        return
    arms = sorted({event.arm for event in events})
    if len(arms) > 1 or job.arm not in (None, arms[0]):
        asked = "" if job.arm is None else f"; arm '{job.arm}' was asked for"
        yield _fault("jobs", f"job '{job.name}' is done by {', '.join(arms)}{asked}", events[0])
    for before, event in pairwise(events):
        if event.begin < before.end - TIME_TOLERANCE_S:
            yield _fault("jobs", f"step {event.step} of job '{job.name}' begins before step {before.step} ends", event)
    for name in job.after:
        late = max((event.end for event in work.of_job(name)), default=np.inf)
        if events[0].begin < late - TIME_TOLERANCE_S:
            yield _fault("jobs", f"job '{job.name}' begins before job '{name}' is done", events[0])


def _steps(work: Work, job: Job) -> Iterator[Violation]:
    """Every step does what it was asked for: a move ends at its goal, a wait is long enough."""
    for event, step in zip(work.of_job(job.name), job.steps, strict=True):
        where = f"step {event.step} of job '{job.name}'"
        if event.arm not in work.motions:
            continue
        motion = work.motions[event.arm]
        if event.kind != step.kind:
            yield _fault("jobs", f"{where} is done by a {event.kind}", event)
        elif step.kind == "wait":
            if event.end - event.begin < step.value - TIME_TOLERANCE_S:
                yield _fault("jobs", f"{where} waits for {event.end - event.begin:g} s; asked: {step.value:g}", event)
            if motion.moves(event.begin, event.end):
                yield _fault("jobs", f"arm '{event.arm}' moves during {where}, a wait", event)
        elif step.kind in ("grasp", "release"):
            if event.object != step.value:
                yield _fault("jobs", f"{where} is about object '{event.object}'; asked: '{step.value}'", event)
            if motion.moves(event.begin, event.end):
                yield _fault("jobs", f"arm '{event.arm}' moves during {where}, a {step.kind}", event)
        elif step.kind == "line":
            off = off_line(work.model, event.arm, motion, (event.begin, event.end), step.value)
            if off is not None:
                yield _fault("line", f"the tool leaves the line of {where}: {off}", event)
        else:
            arm = next(arm for arm in work.cell.arms if arm.name == event.arm)
            begin, end = motion.at(np.array([event.begin, event.end]))
            off = _nearest(work, arm, _asked(arm, step.value, begin, where), event.end, end)
            if off is not None:
                yield _fault("goal", f"{where} ends at nothing that was asked for; {off}", event)


def _asked(arm: CheckedArm, goal: Any, begin: Float[np.ndarray, "dof"], where: str) -> Asked:
    """Returns what a move was asked for, `stay` for where it begins. Raises `UnreadableError`."""
    named = {"stay": begin} | {
        key: numbers(arm.robot.data[key], (arm.dof,), f"{key} of arm '{arm.name}'") for key in ("home", "tucked")
    }
    try:
        return read_asked({arm.name: goal}, {arm.name: named})[arm.name]
    except UnreadableError as error:
        raise UnreadableError(f"{where}: {error.violation.message}") from None


def _nearest(work: Work, arm: CheckedArm, asked: Asked, time: float, end: Float[np.ndarray, "dof"]) -> str | None:
    """Returns words for how far off the nearest goal is; None if a goal is met."""
    whole = np.concatenate([work.motions[other.name].at(np.array([time]))[0] for other in work.cell.arms])
    position, turn = tool_pose(work.model, arm, whole)
    words = []
    for each in asked:
        if isinstance(each, AskedPose):
            metres, angle = each.off(position, turn)
            if metres <= POSE_TOLERANCE_M and angle <= POSE_TOLERANCE_RAD:
                return None
            words.append((metres + angle, f"the nearest is {metres:.3g} m and {angle:.3g} rad away"))
        else:
            error = float(np.abs(end - each).max())
            if error <= JOINT_TOLERANCE:
                return None
            words.append((error, f"a joint of the nearest is {error:.3g} away"))
    return min(words)[1]


def _job(data: Any, arms: Sequence[str], where: str) -> Job:
    name = text(data, "name", where)
    where = f"job '{name}'"
    known(data, ("name", "arm", "steps", "after"), where)
    arm = None if data.get("arm") is None else text(data, "arm", where, arms)
    steps = [_step(step, f"step {k} of {where}") for k, step in enumerate(listed(data, "steps", where))]
    if not steps:
        raise UnreadableError(f"{where} has no steps")
    return Job(name=name, arm=arm, steps=steps, after=listed(data, "after", where, optional=True))


def _step(data: Any, where: str) -> Step:
    known(data, _KINDS[:-1], where)
    if len(data) != 1:
        raise UnreadableError(f"{where} is {shown(data)}; it must be one of {', '.join(_KINDS[:-1])}")
    [(kind, value)] = data.items()
    if kind in ("grasp", "release"):
        value = text(data, kind, where)
    if kind == "line":
        value = numbers(value, (3,), f"line of {where}")
        if not np.isfinite(value).all() or not value.any():
            raise UnreadableError(f"line of {where} is {shown(data[kind])}; it must be finite and not zero")
    elif kind == "wait":
        value = float(positive(value, f"wait of {where}"))
    return Step(kind=kind, value=value)


def _event(data: Any, where: str) -> Event:
    known(data, ("time", "until", "arm", "kind", "object", "pose", "job", "step", "group"), where)
    begin, end = (float(numbers(member(data, key, where), (), f"{key} of {where}")) for key in ("time", "until"))
    if not np.isfinite([begin, end]).all():
        raise UnreadableError(f"{where} is from {begin:g} to {end:g} s; its times must be finite", "finite")
    kind, step = text(data, "kind", where, _KINDS), data.get("step")
    job = None if data.get("job") is None else text(data, "job", where)
    if (kind == "yield") != (job is None) or (job is None) != (step is None):
        raise UnreadableError(f"{where}, a {kind}, must have a job and a step, or none if the arm yields")
    group = data.get("group")
    for name, value in (("step", step), ("group", group)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int)):
            raise UnreadableError(f"{name} of {where} is {shown(value)}; it must be a whole number")
    handled = text(data, "object", where) if kind in ("grasp", "release") else None
    pose = None if handled is None else _pose(member(data, "pose", where), f"pose of {where}")
    arm = text(data, "arm", where)
    return Event(begin=begin, end=end, arm=arm, kind=kind, job=job, step=step, group=group, object=handled, pose=pose)


def _pose(data: Any, where: str) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]]:
    known(data, ("position", "quaternion"), where)
    position = numbers(member(data, "position", where), (3,), f"position of {where}")
    quaternion = numbers(member(data, "quaternion", where), (4,), f"quaternion of {where}")
    if not np.isfinite([*position, *quaternion]).all() or not quaternion.any():
        raise UnreadableError(f"{where} is {shown(data)}; it must be finite, and its quaternion not all zero")
    return position, quaternion


def _fault(rule: str, message: str, event: Event | None = None) -> Violation:
    if event is None:
        return Violation(rule=rule, message=message)
    return Violation(rule=rule, message=message, time_s=event.begin, arms=(event.arm,))
