"""Schedules: proved, checked, the same for the same seed, and every arm in its own time."""

from __future__ import annotations

import pytest

from mmp_env import InvalidInstanceError, MmpError, check_schedule
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import Status, schedule
from mmp_planners.work import scheduling
from tests.support.small_jobs import in_a_ring, jobs, planned, pose


def test_all_jobs_are_done_and_the_checker_agrees():
    result = schedule(jobs())
    assert result.status is Status.SOLVED
    assert result.schedule is not None
    assert check_schedule(result.schedule).valid
    assert set(result.schedule.arm_of) == {"a", "b", "c", "d"}
    assert result.schedule.proof.arms >= result.schedule.problem.margins.arms


def test_the_same_seed_gives_the_same_schedule():
    result = schedule(jobs())
    assert result.schedule is not None
    assert schedule_to_dict(result.schedule) == planned()


def test_an_arm_begins_its_next_step_while_others_move():
    events = [event for event in planned()["events"] if event["kind"] == "move"]
    assert any(a["time"] < b["time"] < a["until"] for a in events for b in events if a["arm"] != b["arm"])


def test_a_job_begins_when_those_before_it_are_done():
    events = planned()["events"]
    done = max(event["until"] for event in events if event.get("job") == "a")
    assert min(event["time"] for event in events if event.get("job") == "c") >= done


def test_a_job_without_an_arm_goes_to_one_that_can_do_it():
    data = in_a_ring(jobs=[{"name": "far", "steps": [{"move": pose(1.2, 0.0, 0.5)}]}])
    result = schedule(jobs(data))
    assert result.schedule is not None
    assert result.schedule.arm_of["far"] == "arm0"


@pytest.mark.parametrize("arm", [{}, {"arm": "arm0"}])
def test_a_goal_out_of_reach_is_refused_before_planning(arm):
    data = in_a_ring(jobs=[{"name": "far", **arm, "steps": [{"wait": 1}, {"move": pose(9.0, 0.0, 0.5)}]}])
    with pytest.raises(InvalidInstanceError, match="step 1 of job 'far' is out of reach"):
        schedule(jobs(data))


def test_an_unknown_planner_is_refused():
    with pytest.raises(MmpError, match="unknown planner 'auot'"):
        schedule(jobs(), planner="auot")


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"max_acceleration": 1e-9}, "its limits are too low for its length"),
        ({"max_jerk": 1e-6}, "the limits of the joints are too low for it"),
        ({"max_velocity": 1e-7}, "max_velocity too low"),
        ({"max_jerk": -1.0}, "max_jerk of arm 'arm0' must be a positive number"),
        ({"max_acceleration": {"arm9": 1.0}}, "unknown arm 'arm9'"),
    ],
)
def test_limits_that_no_schedule_can_keep_are_refused(limits, words):
    with pytest.raises(MmpError, match=words):
        schedule(jobs(), **limits)


def test_each_motion_is_proved_if_the_proof_of_the_schedule_fails(monkeypatch):
    proof, proofs = scheduling._proof, []

    def failing_once(*arguments):
        proofs.append(None if not proofs else proof(*arguments))
        return proofs[-1]

    monkeypatch.setattr(scheduling, "_proof", failing_once)
    result = schedule(jobs())
    assert len(proofs) == 2
    assert result.schedule is not None
    assert check_schedule(result.schedule).valid
