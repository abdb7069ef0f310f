"""Arms that block each other: they wait, yield, or are planned together; otherwise the result names them."""

from __future__ import annotations

import pytest

from mmp_env import check_schedule
from mmp_planners import Status, schedule
from mmp_planners.work.group import Together
from mmp_planners.work.yielding import Yielding
from tests.support.small_jobs import jobs, pose

MIDDLE = pose(0.0, 0.0, 0.5)


def _two(steps: dict[str, list], **more):
    """Returns jobs of two UR5e that both reach the middle."""
    of_arm = [{"name": f"of-{arm}", "arm": arm, "steps": todo} for arm, todo in steps.items()]
    return jobs({"schema": "mmp-jobs/1", "name": "two", "cell": "ring-2", "jobs": of_arm} | more)


def test_an_arm_waits_until_another_has_left():
    result = schedule(_two({"arm0": [{"move": MIDDLE}, {"move": "tucked"}], "arm1": [{"move": MIDDLE}]}))
    assert result.schedule is not None
    assert result.stats["yields"] == 0
    assert check_schedule(result.schedule).valid


def test_an_arm_without_work_yields():
    result = schedule(_two({"arm0": [{"move": MIDDLE}], "arm1": [{"wait": 20.0}, {"move": MIDDLE}]}))
    assert result.schedule is not None
    assert [event.arm for event in result.schedule.events if event.kind == "yield"] == ["arm0"]
    assert check_schedule(result.schedule).valid


@pytest.mark.parametrize("seed", range(3))
def test_arms_that_change_places_do_not_wait_for_each_other_for_ever(seed):
    left, right = pose(0.25, 0.1, 0.4), pose(-0.25, -0.1, 0.4)
    first = {"arm0": [{"move": left}, {"move": right}], "arm1": [{"move": right}, {"move": left}]}
    result = schedule(_two(first), seed=seed, time_limit=60.0)
    assert result.schedule is not None
    assert check_schedule(result.schedule).valid


def test_goals_that_cannot_be_held_at_once_end_in_a_schedule_that_yields():
    result = schedule(_two({"arm0": [{"move": MIDDLE}, {"wait": 1.0}], "arm1": [{"move": MIDDLE}, {"wait": 1.0}]}))
    assert result.schedule is not None
    assert check_schedule(result.schedule).valid
    assert result.stats["yields"] + result.stats["group_plans"] > 0


def test_a_blocked_arm_is_named_when_time_is_up():
    result = schedule(_two({"arm0": [{"move": MIDDLE}], "arm1": [{"move": MIDDLE}]}), time_limit=1e-6)
    assert result.status is Status.TIMEOUT
    assert result.blocked
    assert set(result.blocked) <= {"arm0", "arm1"}
    assert all(arm in result.message for arm in result.blocked)


def test_all_arms_are_planned_together_where_no_arm_can_yield_alone(monkeypatch):
    monkeypatch.setattr(Yielding, "clear_path", lambda *_: [])
    result = schedule(_two({"arm0": [{"move": MIDDLE}], "arm1": [{"wait": 9.0}, {"move": MIDDLE}, {"move": "tucked"}]}))
    assert result.schedule is not None
    assert result.stats["group_plans"] == 1
    assert check_schedule(result.schedule).valid


def test_arms_that_nothing_helps_are_named(monkeypatch):
    monkeypatch.setattr(Yielding, "clear_path", lambda *_: [])
    monkeypatch.setattr(Together, "move", lambda *_: None)
    result = schedule(_two({"arm0": [{"move": MIDDLE}], "arm1": [{"wait": 9.0}, {"move": MIDDLE}]}))
    assert result.status is Status.EXHAUSTED
    assert result.blocked == ("arm1",)
    assert (
        result.message == "no motion was found for the next step of arm arm1, although other arms were asked to yield"
    )
