"""Small files of jobs, for tests of programs that read jobs and schedules."""

from __future__ import annotations

import functools
import json
from typing import Any

from mmp_env.work.jobs import Jobs
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.schedule import Schedule
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import schedule


def pose(*position: float) -> dict[str, Any]:
    """Returns a goal of the tool, with its rotation free."""
    return {"pose": {"position": list(position), "free": "rotation"}}


def in_a_ring(**more: Any) -> dict[str, Any]:
    """Returns four jobs of four UR5e in a ring."""
    jobs = [
        {"name": "a", "arm": "arm0", "steps": [{"move": pose(0.0, 0.15, 0.5)}, {"wait": 0.5}, {"move": "tucked"}]},
        {"name": "b", "arm": "arm1", "steps": [{"move": pose(0.0, -0.1, 0.6)}, {"wait": 0.5}, {"move": "tucked"}]},
        {"name": "c", "steps": [{"move": pose(0.1, 0.0, 0.4)}, {"move": "tucked"}], "after": ["a"]},
        {"name": "d", "steps": [{"move": {"any": [pose(-0.2, 0.0, 0.4), "tucked"]}}, {"wait": 1.0}]},
    ]
    return {"schema": "mmp-jobs/1", "name": "four", "cell": "ring-4", "jobs": jobs} | more


def above(*position: float) -> dict[str, Any]:
    """Returns a goal of the tool, which points down."""
    return {"pose": {"position": list(position), "quaternion": [0.0, 1.0, 0.0, 0.0], "free": "z"}}


def with_lines(**more: Any) -> dict[str, Any]:
    """Returns three jobs of four UR5e in a ring that approach and retreat along straight lines."""
    down, up = {"line": [0.0, 0.0, -0.1]}, {"line": [0.0, 0.0, 0.1]}
    places = {"a": (0.1, 0.15, 0.35), "b": (-0.1, 0.2, 0.35), "c": (0.15, -0.1, 0.35)}
    jobs = [{"name": k, "steps": [{"move": above(*at)}, down, {"wait": 0.2}, up]} for k, at in places.items()]
    return {"schema": "mmp-jobs/1", "name": "lines", "cell": "ring-4", "jobs": jobs} | more


def jobs(data: dict[str, Any] | None = None) -> Jobs:
    """Returns the jobs of `in_a_ring`, or of other data."""
    return jobs_from_dict(in_a_ring() if data is None else data, "jobs.json")


@functools.cache
def planned_schedule(lines: bool = False) -> Schedule:
    """Returns a schedule of `in_a_ring`, or of `with_lines`."""
    result = schedule(jobs(with_lines() if lines else None))
    assert result.schedule is not None
    return result.schedule


@functools.cache
def _planned(lines: bool) -> str:
    return json.dumps(schedule_to_dict(planned_schedule(lines)))


def planned(lines: bool = False) -> dict[str, Any]:
    """Returns a new copy of the content of a schedule file of `in_a_ring`, or of `with_lines`."""
    return json.loads(_planned(lines))
