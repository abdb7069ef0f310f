"""Small files of jobs, for tests of programs that read jobs and schedules."""

from __future__ import annotations

import functools
import json
from typing import Any

from mmp_env.work.jobs import Jobs
from mmp_env.work.jobs_file import jobs_from_dict
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


def jobs(data: dict[str, Any] | None = None) -> Jobs:
    """Returns the jobs of `in_a_ring`, or of other data."""
    return jobs_from_dict(in_a_ring() if data is None else data, "jobs.json")


@functools.cache
def _planned() -> str:
    result = schedule(jobs())
    assert result.schedule is not None
    return json.dumps(schedule_to_dict(result.schedule))


def planned() -> dict[str, Any]:
    """Returns a new copy of the content of a schedule file of `in_a_ring`."""
    return json.loads(_planned())
