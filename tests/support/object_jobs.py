"""Small files of jobs with objects, for tests of programs that read jobs and schedules."""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from typing import Any

from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.schedule import Schedule
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import schedule

HEIGHT_M = 0.1
"""Height of the objects."""
GAP_M = 0.002
"""Distance of a flange from the top of an object that it grasps."""
AWAY_M = 0.12
"""Length of the lines to objects and away from them."""


def box(name: str, x: float, y: float, z: float = 0.0) -> dict[str, Any]:
    """Returns an upright box whose underside is at a point."""
    size = [0.05, 0.05, HEIGHT_M]
    return {"name": name, "shape": "box", "size": size, "pose": {"position": [x, y, z + HEIGHT_M / 2]}}


def above(x: float, y: float, z: float = 0.0) -> dict[str, Any]:
    """Returns a step that moves the flange above an object whose underside is at a point."""
    position = [x, y, z + HEIGHT_M + GAP_M + AWAY_M]
    return {"move": {"pose": {"position": position, "quaternion": [0, 1, 0, 0], "free": "z"}}}


DOWN: dict[str, Any] = {"line": [0, 0, -AWAY_M]}
UP: dict[str, Any] = {"line": [0, 0, AWAY_M]}


def carry(
    name: str, what: str, begin: Sequence[float], end: Sequence[float], arm: str | None = "arm0", **more: Any
) -> dict[str, Any]:
    """Returns a job that takes an object at one point and puts it down at another."""
    steps = [above(*begin), DOWN, {"grasp": what}, UP, above(*end), DOWN, {"release": what}, UP]
    return {"name": name, "steps": steps, **({"arm": arm} if arm else {}), **more}


def handing_over(**more: Any) -> dict[str, Any]:
    """Returns jobs of two UR5e: one hands an object to the other, which puts it on a third object."""
    jobs = [
        carry("give", "red", (0.15, 0.25), (0.0, 0.0)),
        carry("take", "red", (0.0, 0.0), (-0.15, 0.25, HEIGHT_M), "arm1", after=["give"]),
        carry("tidy", "blue", (0.15, -0.25), (0.25, 0.25)),
    ]
    objects = [box("red", 0.15, 0.25), box("blue", 0.15, -0.25), box("green", -0.15, 0.25)]
    data = {"schema": "mmp-jobs/1", "name": "handing-over", "cell": "ring-2", "objects": objects, "jobs": jobs}
    return data | more


def work(*jobs: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Returns jobs of two UR5e with a red box and a blue one."""
    objects = [box("red", 0.1, 0.2), box("blue", 0.1, -0.2)]
    data = {"schema": "mmp-jobs/1", "name": "work", "cell": "ring-2", "objects": objects, "jobs": list(jobs)}
    return data | more


@functools.cache
def planned_schedule() -> Schedule:
    """Returns a schedule of `handing_over`."""
    result = schedule(jobs_from_dict(handing_over(), "jobs.json"))
    assert result.schedule is not None, result.message
    return result.schedule


@functools.cache
def _planned() -> str:
    return json.dumps(schedule_to_dict(planned_schedule()))


def planned() -> dict[str, Any]:
    """Returns a new copy of the content of a schedule file of `handing_over`."""
    return json.loads(_planned())
