"""Schedule files, schema `mmp-schedule/1`: self-contained, the same bytes for the same schedule."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from typing import Any

import msgspec
import numpy as np

from mmp_env.argument_checks import given, require_finite
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.cell_file import CellData, cell_from_data, cell_to_dict
from mmp_env.files.file_kinds import SCHEDULE, read_for
from mmp_env.files.instance_file import check_arms, configurations_from_dict
from mmp_env.files.reading import MAX_JSON_BYTES, Location, decode_file, named, numbers
from mmp_env.files.solid_data import check_name
from mmp_env.files.writing import json_text, plain, write_text
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.goals import JointGoal
from mmp_env.model.margins import KINDS, LEAST_MARGIN_M, Margins
from mmp_env.model.problem import Problem, velocity_limits
from mmp_env.model.robot import frozen_array
from mmp_env.wording import counted
from mmp_env.work.jobs import Jobs, job_to_data
from mmp_env.work.jobs_file import job_from_data
from mmp_env.work.objects_file import objects_from_data, objects_to_data, pose_from_data
from mmp_env.work.schedule import KINDS_OF_EVENTS, OrderPair, Schedule, WorkEvent
from mmp_env.work.trajectory import Trajectory

SCHEDULE_SCHEMA = "mmp-schedule/1"
SHORTEST_PERIOD_S, LONGEST_PERIOD_S = 1e-4, 1.0
"""Bounds of the period of a schedule [s]."""
PERIOD_TOLERANCE = 1e-6
"""Largest distance of a time from a multiple of the period [periods]."""


class MarginsData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    arms: float | None
    obstacles: float | None
    self_: float | None = msgspec.field(name="self")


class TrajectoryData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    times: list[Any]
    positions: list[Any]


class EventData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    time: float
    until: float
    arm: str
    kind: str
    object: str | None = None
    pose: dict[str, Any] | None = None
    job: str | None = None
    step: int | None = None
    group: int | None = None


class ScheduleData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    name: str
    cell: CellData
    start: dict[str, Any]
    max_velocity: dict[str, Any]
    max_acceleration: dict[str, Any]
    max_jerk: dict[str, Any]
    period_s: float
    margins: MarginsData
    jobs: list[dict[str, Any]]
    trajectories: dict[str, TrajectoryData]
    events: list[EventData]
    proof: MarginsData
    objects: list[dict[str, Any]] = []
    order: list[tuple[tuple[str, int], tuple[str, int]]] = []
    order_past_s: list[float] = []
    planner: dict[str, Any] = {}
    stats: dict[str, Any] = {}


def schedule_to_dict(schedule: Schedule) -> dict[str, Any]:
    """Returns the schedule in the form of `mmp-schedule/1`, in dicts, lists and scalars."""
    problem, names = schedule.problem, schedule.problem.cell.arm_names
    return plain(
        {
            "schema": SCHEDULE_SCHEMA,
            "name": schedule.jobs.name,
            "cell": cell_to_dict(problem.cell),
            "start": {name: problem.start[name] for name in names},
            "max_velocity": {name: problem.max_velocity[name] for name in names},
            "max_acceleration": {name: schedule.max_acceleration[name] for name in names},
            "max_jerk": {name: schedule.max_jerk[name] for name in names},
            "period_s": schedule.trajectories[names[0]].period_s,
            "margins": dict(problem.margins),
            **({"objects": objects_to_data(schedule.jobs.objects)} if schedule.jobs.objects else {}),
            "jobs": [job_to_data(job) for job in schedule.jobs.jobs],
            "trajectories": {
                name: {"times": schedule.trajectories[name].times, "positions": schedule.trajectories[name].positions}
                for name in names
            },
            "events": [_event_to_data(event) for event in schedule.events],
            "order": [[list(pair.first), list(pair.second)] for pair in schedule.order],
            "order_past_s": [pair.past_s for pair in schedule.order],
            "proof": dict(schedule.proof),
            "planner": schedule.planner,
            "stats": schedule.stats,
        }
    )


def schedule_from_dict(data: Any, where: str | Location = "schedule") -> Schedule:
    """Returns the schedule in a file's `data`. The checker, not this function, tests that the schedule is right.

    Raises:
        MmpError: for malformed data, with field and value.
    """
    place, decoded = decode_file(data, SCHEDULE_SCHEMA, ScheduleData, where)
    for key in ("planner", "stats"):
        require_finite(getattr(decoded, key), str(place / key))
    check_name(decoded.name, place / "name")
    cell = cell_from_data(decoded.cell, place / "cell", name=decoded.name)
    start = configurations_from_dict(cell, decoded.start, place / "start")
    jobs = tuple(job_from_data(job, place / "jobs" / k) for k, job in enumerate(decoded.jobs))
    objects = objects_from_data(decoded.objects, place / "objects")
    first = {name: JointGoal(q) for name, q in start.items()}
    with named(place):
        work = Jobs(name=decoded.name, cell=cell, jobs=jobs, start=first, objects=objects)
    limits = configurations_from_dict(cell, decoded.max_velocity, place / "max_velocity")
    trajectories = _trajectories(cell, decoded.trajectories, decoded.period_s, place / "trajectories")
    with named(place / "margins"):
        problem = Problem(
            cell=cell,
            start=start,
            goal={name: trajectory.positions[-1] for name, trajectory in trajectories.items()},
            max_velocity=velocity_limits(cell, limits),
            margins=_margins(decoded.margins, place / "margins"),
            name=decoded.name,
        )
    return Schedule(
        jobs=work,
        problem=problem,
        max_acceleration=configurations_from_dict(cell, decoded.max_acceleration, place / "max_acceleration"),
        max_jerk=configurations_from_dict(cell, decoded.max_jerk, place / "max_jerk"),
        trajectories=trajectories,
        events=tuple(_event(work, event, place / "events" / k) for k, event in enumerate(decoded.events)),
        order=_order(decoded, place / "order"),
        proof=_margins(decoded.proof, place / "proof"),
        planner=decoded.planner,
        stats=decoded.stats,
    )


def save_schedule(schedule: Schedule, path: str | PathLike[str]) -> None:
    """Writes a schedule file, the whole file or nothing. The same schedule gives the same bytes.

    Args:
        schedule: the schedule.
        path: the file; a file that is there is replaced.

    Raises:
        MmpError: for another object, a schedule larger than 64 MB, and a file that cannot be written.
    """
    text = json_text(schedule_to_dict(given("schedule", schedule, Schedule, "the .schedule of a result of schedule()")))
    if len(text) > MAX_JSON_BYTES:
        size, most = len(text) / 2**20, MAX_JSON_BYTES / 2**20
        raise MmpError(f"{path}: the schedule takes {size:.0f} MB as a file; {most:.0f} MB is the most that is read")
    write_text(path, text)


def load_schedule(path: str | PathLike[str]) -> Schedule:
    """Reads a schedule file, schema `mmp-schedule/1`. The schedule may still be wrong; `mmp check` tests it.

    Args:
        path: a JSON file.

    Raises:
        MmpError: for a file that cannot be read, or malformed data, with file, field and value.
    """
    return schedule_from_dict(read_for("load_schedule", path, SCHEDULE), str(path))


def _event_to_data(event: WorkEvent) -> dict[str, Any]:
    what = {} if event.job is None else {"job": event.job, "step": event.step}
    group = {} if event.group is None else {"group": event.group}
    solid = {}
    if event.solid is not None:
        pose = {"position": event.solid.position.tolist(), "quaternion": event.solid.quaternion.tolist()}
        solid = {"object": event.solid.name, "pose": pose}
    return {"time": event.begin_s, "until": event.end_s, "arm": event.arm, "kind": event.kind, **solid, **what, **group}


def _event(jobs: Jobs, data: EventData, place: Location) -> WorkEvent:
    if data.arm not in jobs.cell.arm_names:
        raise MmpError(f"{place}: {UnknownNameError('arm', data.arm, jobs.cell.arm_names)}")
    if data.kind not in KINDS_OF_EVENTS:
        raise MmpError(f"{place}: {UnknownNameError('kind of event', data.kind, KINDS_OF_EVENTS)}")
    return WorkEvent(
        begin_s=data.time,
        end_s=data.until,
        arm=data.arm,
        kind=data.kind,
        job=data.job,
        step=data.step,
        group=data.group,
        solid=_solid(jobs, data, place),
    )


def _solid(jobs: Jobs, data: EventData, place: Location) -> Obstacle | None:
    """Returns the object of an event, where it is then; None for an event without one."""
    if data.kind not in ("grasp", "release"):
        if data.object is not None or data.pose is not None:
            raise MmpError(f"{place} is a {data.kind}; only a grasp or a release has an object and a pose")
        return None
    names = {each.name: each for each in jobs.objects}
    if data.object not in names:
        raise MmpError(f"{place / 'object'}: {UnknownNameError('object', data.object, names)}")
    position, quaternion = pose_from_data(data.pose, place / "pose")
    return replace(names[data.object], position=position, quaternion=quaternion)


def _order(data: ScheduleData, place: Location) -> tuple[OrderPair, ...]:
    if len(data.order) != len(data.order_past_s):
        raise MmpError(
            f"{place} has {counted(len(data.order), 'pair')}, and order_past_s has {len(data.order_past_s)} times;"
            " they must be as many"
        )
    pairs = zip(data.order, data.order_past_s, strict=True)
    return tuple(OrderPair(first=first, second=second, past_s=past) for (first, second), past in pairs)


def _margins(data: MarginsData, place: Location) -> Margins:
    """Returns the clearances [m]; null, infinity, where there is nothing of the kind. Raises `MmpError`."""
    by_kind = tuple(zip(KINDS, (data.arms, data.obstacles, data.self_), strict=True))
    for kind, value in by_kind:
        if value is not None and value != 0.0 and not LEAST_MARGIN_M <= value < math.inf:
            raise (place / kind).wrong(value, f"a clearance in metres: 0, or {LEAST_MARGIN_M:g} or more; or null")
    return Margins(**{kind: float("inf") if value is None else value for kind, value in by_kind})


def _trajectories(
    cell: Cell, data: Mapping[str, TrajectoryData], period_s: float, place: Location
) -> dict[str, Trajectory]:
    check_arms(cell, data, place)
    if not SHORTEST_PERIOD_S <= period_s <= LONGEST_PERIOD_S:
        raise MmpError(
            f"{place}: period_s is {period_s:g} s; it must be from {SHORTEST_PERIOD_S:g} to {LONGEST_PERIOD_S:g} s"
        )
    out = {}
    for arm in cell.arms:
        here, given = place / arm.name, data[arm.name]
        count = len(given.times)
        if not count or count != len(given.positions):
            raise MmpError(
                f"{here} has {count} times and {len(given.positions)} positions; it must have as many, at least one"
            )
        of = f"joint of a {arm.robot.name}"
        rows = [numbers(row, arm.dof, here / "positions" / k, of) for k, row in enumerate(given.positions)]
        times = np.array(numbers(given.times, count, here / "times", "time"), dtype=float)
        steps = times / period_s
        if (np.diff(times) <= 0).any() or np.abs(steps - np.round(steps)).max() > PERIOD_TOLERANCE:
            raise MmpError(f"{here / 'times'} must be ascending multiples of the period, {period_s:g} s")
        positions = frozen_array(np.array(rows, dtype=float))
        out[arm.name] = Trajectory(times=frozen_array(times), positions=positions, period_s=period_s)
    return out
