"""Schedules in which arms take objects, hand them over and put them on others."""

from __future__ import annotations

import pytest

from mmp_env import check_schedule
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_planners import schedule
from tests.support.object_jobs import DOWN, HEIGHT_M, UP, above, box, carry, handing_over, planned_schedule, work


def plan(data, **options):
    return schedule(jobs_from_dict(data, "jobs.json"), **options)


def test_an_object_is_handed_over_and_put_on_another():
    found = planned_schedule()
    report = check_schedule(found)
    assert report.valid, report.sentences
    kinds = [(event.arm, event.kind) for event in found.events if event.solid and event.solid.name == "red"]
    assert kinds == [("arm0", "grasp"), ("arm0", "release"), ("arm1", "grasp"), ("arm1", "release")]
    last = [event.solid for event in found.events if event.solid and event.solid.name == "red"][-1]
    assert last.position == pytest.approx([-0.15, 0.25, 1.5 * HEIGHT_M], abs=1e-4)


def test_the_same_seed_gives_the_same_schedule():
    again = plan(handing_over()).schedule
    assert [event.begin_s for event in again.events] == [event.begin_s for event in planned_schedule().events]


def test_jobs_without_an_arm_are_given_to_one_that_reaches_the_object():
    far = carry("far", "red", (-0.5, 0.6), (-0.6, 0.5), None)
    result = plan(work(far, objects=[box("red", -0.5, 0.6)]))
    assert {event.arm for event in result.schedule.events if event.job} == {"arm1"}


def test_a_stack_is_built_in_the_order_that_it_needs_although_no_job_says_so():
    top = carry("top", "blue", (0.1, -0.2), (0.1, 0.0, HEIGHT_M))
    base = carry("base", "red", (0.1, 0.2), (0.1, 0.0), "arm1")
    result = plan(work(top, base))
    assert result.schedule is not None, result.message
    assert check_schedule(result.schedule).valid


def test_an_arm_holds_an_object_from_one_job_to_the_next():
    take = {"name": "take", "arm": "arm0", "steps": [above(0.1, 0.2), DOWN, {"grasp": "red"}, UP]}
    steps = [above(0.0, 0.3), DOWN, {"release": "red"}, UP]
    put = {"name": "put", "arm": "arm0", "steps": steps, "after": ["take"]}
    other = carry("other", "blue", (0.1, -0.2), (0.0, -0.3))
    result = plan(work(take, other, put))
    assert result.schedule is not None, result.message
    assert check_schedule(result.schedule).valid
    order = [event.job for event in result.schedule.events if event.kind in ("grasp", "release")]
    assert order.index("put") == order.index("take") + 1


BAD = {
    "far": (carry("a", "red", (0.1, 0.1), (0.0, 0.3)), "out of reach: it is 0.075 m from the tool"),
    "fall": (carry("a", "red", (0.1, 0.2), (0.0, 0.3, 0.05)), "so it would fall"),
    "into the table": (carry("a", "red", (0.1, 0.2), (0.0, 0.3, -0.01)), "so it would fall"),
    "tip": (carry("a", "red", (0.1, 0.2), (0.13, -0.2, HEIGHT_M)), "its centre is not above blue"),
    "collide": (carry("a", "red", (0.1, 0.2), (0.14, -0.2)), "arm0/held and obstacle/blue"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_step_that_cannot_be_done_is_refused_with_one_sentence(name):
    job, words = BAD[name]
    with pytest.raises(InvalidInstanceError, match=words):
        plan(work(job))


def test_nothing_is_taken_from_under_another_object():
    first = carry("a", "red", (0.1, 0.2), (0.1, -0.2, HEIGHT_M))
    with pytest.raises(InvalidInstanceError, match="grasps 'blue' while 'red' stands on it"):
        plan(work(first, carry("b", "blue", (0.1, -0.2), (0.0, 0.3), after=["a"])))


def test_a_gripper_that_stays_full_is_refused():
    take = {"name": "take", "arm": "arm0", "steps": [above(0.1, 0.2), DOWN, {"grasp": "red"}, UP]}
    with pytest.raises(MmpError, match="grasps 'blue', but the gripper of its arm is full: it holds 'red'"):
        plan(work(take, carry("b", "blue", (0.1, -0.2), (0.0, 0.3), after=["take"])))


def test_an_object_in_the_air_is_refused():
    with pytest.raises(InvalidInstanceError, match="object 'red' does not stay where it is"):
        plan(work(carry("a", "red", (0.1, 0.2), (0.0, 0.3)), objects=[box("red", 0.1, 0.2, 0.05)]))
