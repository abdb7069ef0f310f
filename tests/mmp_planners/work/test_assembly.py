"""Assembly by two arms in a fixed order: towers, bridges, and a part that one arm holds while the other works."""

from __future__ import annotations

from typing import Any

import pytest

from mmp_env import execute_schedule
from mmp_env.check.schedule import check_schedule_document
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import schedule
from tests.support.object_jobs import DOWN, HEIGHT_M, UP, above, box, carry


def tower() -> dict[str, Any]:
    """Returns jobs of two arms that stack boxes in turns."""
    places = [(-0.05, 0.3), (-0.05, -0.3), (0.1, 0.3)]
    jobs = []
    for k, place in enumerate(places):
        after = [f"put{k - 1}"] if k else []
        job = carry(f"put{k}", f"box{k}", place, (0.0, 0.0, k * HEIGHT_M), f"arm{k % 2}", after=after)
        jobs.append({**job, "steps": [*job["steps"], {"move": "tucked"}]})
    return {"objects": [box(f"box{k}", *place) for k, place in enumerate(places)], "jobs": jobs}


def bridge() -> dict[str, Any]:
    """Returns jobs of two arms that put up two pillars and lay a beam on them."""
    beam = box("beam", -0.15, 0.3) | {"size": [0.3, 0.05, HEIGHT_M]}
    top = carry("top", "beam", (-0.15, 0.3), (0.0, 0.0, HEIGHT_M), after=["left", "right"])
    for step in (top["steps"][0], top["steps"][4]):
        del step["move"]["pose"]["free"]
    left, right = (carry("left", "p0", (0.1, 0.3), (-0.1, 0.0)), carry("right", "p1", (0.1, -0.3), (0.1, 0.0), "arm1"))
    return {"objects": [box("p0", 0.1, 0.3), box("p1", 0.1, -0.3), beam], "jobs": [left, right, top]}


def lid() -> dict[str, Any]:
    """Returns jobs in which one arm holds a lid until the other has put the body below it."""
    hold = {
        "name": "hold",
        "arm": "arm0",
        "steps": [above(0.1, 0.3), DOWN, {"grasp": "lid"}, UP, above(0.0, 0.0, 0.25)],
    }
    body = carry("body", "body", (0.1, -0.3), (0.0, 0.0), "arm1", after=["hold"])
    down = [above(0.0, 0.0, HEIGHT_M), DOWN, {"release": "lid"}, UP]
    close = {"name": "close", "arm": "arm0", "after": ["body"], "steps": down}
    body["steps"].append({"move": "tucked"})
    return {"objects": [box("lid", 0.1, 0.3), box("body", 0.1, -0.3)], "jobs": [hold, body, close]}


@pytest.mark.parametrize("make", [tower, bridge, lid])
def test_two_arms_assemble_in_a_fixed_order(make):
    data = {"schema": "mmp-jobs/1", "name": make.__name__, "cell": "ring-2"} | make()
    result = schedule(jobs_from_dict(data, "jobs.json"))
    assert result.schedule is not None, result.message
    assert check_schedule_document(schedule_to_dict(result.schedule)).valid
    report = execute_schedule(result.schedule, delays=2.0, seed=0)
    assert report.reached
    assert not report.contacts
