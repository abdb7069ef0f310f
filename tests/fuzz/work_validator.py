"""Nonsense in jobs and schedules, by docs/reference/files.md#jobs. It shares no code with the readers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fuzz import goal_validator, plan_validator
from fuzz.cell_validator import cell_nonsense, joints_of, named_nonsense, pose_nonsense, shape_nonsense
from fuzz.json_values import is_name, is_number, is_positive, is_vector, is_whole, missing, objects, wrong

STEPS = ("move", "line", "grasp", "release", "wait")
KINDS = (*STEPS, "yield")
"""Kinds of events."""


def jobs_nonsense(document: dict[str, Any]) -> Iterator[str]:
    """Yields what is wrong with a file of jobs."""
    cell = document.get("cell")
    if not isinstance(cell, str):
        yield from cell_nonsense(cell)
    joints = joints_of(cell)
    yield from wrong(document, "name", is_name(document.get("name")))
    if document.get("start") is not None:
        yield from goal_validator.ends_nonsense(document["start"], joints, is_start=True, are_all=False)
    yield from _work_nonsense(document, joints)


def schedule_nonsense(document: dict[str, Any]) -> Iterator[str]:
    """Yields why no reader may take a schedule."""
    yield from cell_nonsense(document.get("cell"))
    joints = joints_of(document.get("cell"))
    yield from goal_validator.configurations_nonsense("start", document.get("start"), joints)
    yield from plan_validator.limits_nonsense(document, joints)
    yield from plan_validator.margins_nonsense(document.get("margins"))
    yield from missing(document, "period_s", "trajectories", "events")
    yield from wrong(document, "period_s", is_positive(document.get("period_s")))
    yield from _work_nonsense(document, joints)
    tracks = document.get("trajectories")
    if not isinstance(tracks, dict) or set(tracks) != set(joints):
        yield "trajectories of other arms"
    else:
        for arm, track in tracks.items():
            yield from _track_nonsense(arm, track, joints[arm])
    yield from _events_nonsense(document, joints)


def _track_nonsense(arm: str, track: Any, joints: int | None) -> Iterator[str]:
    times = track.get("times") if isinstance(track, dict) else None
    if not isinstance(times, list) or not times or not is_vector(times, None):
        yield f"times of {arm} {str(times)[:60]}"
    else:
        yield from plan_validator.rows_nonsense("positions", {arm: track.get("positions")}, {arm: joints}, len(times))


def _events_nonsense(document: dict[str, Any], joints: Mapping[str, int | None]) -> Iterator[str]:
    events, order, past = (document.get(key) for key in ("events", "order", "order_past_s"))
    if not isinstance(events, list) or len(objects(events)) < len(events):
        yield f"events {str(events)[:60]}"
        return
    for event in objects(events):
        if event.get("arm") not in joints or event.get("kind") not in KINDS:
            yield f"an event {str(event)[:60]}"
        if not is_number(event.get("time")) or not is_number(event.get("until")):
            yield f"an event from {event.get('time')} until {event.get('until')}"
        elif event["until"] < event["time"]:
            yield "an event that ends before it begins"
    if isinstance(order, list) and isinstance(past, list) and len(order) != len(past):
        yield "order_past_s of other pairs"
    for pair in order if isinstance(order, list) else []:
        ends = pair if isinstance(pair, list) and len(pair) == 2 else [None]
        if not all(
            isinstance(end, list) and len(end) == 2 and end[0] in joints and is_whole(end[1], 0) for end in ends
        ):
            yield f"order {str(pair)[:60]}"


def _work_nonsense(document: dict[str, Any], joints: Mapping[str, int | None]) -> Iterator[str]:
    """Yields what is wrong with the objects and the jobs of a file."""
    things, jobs = document.get("objects"), document.get("jobs")
    yield from wrong(document, "objects", isinstance(things, list) and len(objects(things)) == len(things))
    for thing in objects(things):
        pose = thing.get("pose")
        yield from named_nonsense(thing, "an object")
        yield from shape_nonsense(thing, list(joints))
        yield from wrong(thing, "pose", isinstance(pose, dict))
        yield from pose_nonsense(pose if isinstance(pose, dict) else thing, plan_validator.MOST_YAW)
    if not isinstance(jobs, list) or not jobs or len(objects(jobs)) < len(jobs):
        yield f"jobs {str(jobs)[:60]}"
        return
    names = [job.get("name") for job in objects(jobs)]
    known = [thing.get("name") for thing in objects(things)]
    for job in objects(jobs):
        yield from _job_nonsense(job, names, joints)
        steps = job.get("steps")
        if not isinstance(steps, list) or not steps or len(objects(steps)) < len(steps):
            yield f"steps {str(steps)[:60]}"
        arm = job.get("arm")
        for step in objects(steps):
            yield from _step_nonsense(step, known, joints.get(arm) if isinstance(arm, str) else None)
    yield from _circles({job.get("name"): job.get("after") for job in objects(jobs)})


def _job_nonsense(job: dict[str, Any], names: list[Any], joints: Mapping[str, int | None]) -> Iterator[str]:
    if not is_name(job.get("name")):
        yield f"a job named {str(job.get('name'))[:60]!r}"
    if joints and job.get("arm") is not None and job["arm"] not in joints:
        yield f"a job of {str(job['arm'])[:60]!r}"
    after = job.get("after")
    if after is None:
        return
    if not isinstance(after, list):
        yield f"after {str(after)[:60]}"
        return
    for other in after:
        if other not in names or other == job.get("name"):
            yield f"a job after {str(other)[:60]!r}"


def _circles(after: dict[Any, Any]) -> Iterator[str]:
    """Yields a sentence if jobs wait for each other."""
    left = {
        name: {other for other in others or [] if other in after}
        for name, others in after.items()
        if isinstance(others, list | None)
    }
    while ready := [name for name, others in left.items() if not others & set(left)]:
        for name in ready:
            del left[name]
    if left:
        yield f"jobs that wait for each other: {sorted(map(str, left))}"


def _step_nonsense(step: dict[str, Any], known: list[Any], joints: int | None) -> Iterator[str]:
    if len(step) != 1 or (kind := next(iter(step))) not in STEPS:
        yield f"a step {str(step)[:60]}"
        return
    value = step[kind]
    if kind == "move":
        yield from goal_validator.goal_nonsense(value, joints, is_start=False)
    elif kind == "wait" and not is_number(value, 0.0):
        yield f"wait {str(value)[:60]}"
    elif kind == "line" and not is_vector(value, 3):
        yield f"line {str(value)[:60]}"
    elif kind in ("grasp", "release") and value not in known:
        yield f"{kind} of {str(value)[:60]!r}"
