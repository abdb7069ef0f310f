"""Schedule files: the same after writing and reading, and a sentence for each fault."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mmp_env import MmpError, check_schedule, load_schedule, save_schedule
from mmp_env.work.schedule_file import schedule_from_dict, schedule_to_dict
from tests.support.small_jobs import planned


def test_a_schedule_is_the_same_after_writing_and_reading(tmp_path):
    schedule = schedule_from_dict(planned())
    save_schedule(schedule, tmp_path / "schedule.json")
    assert schedule_to_dict(load_schedule(tmp_path / "schedule.json")) == planned()
    assert check_schedule(schedule).valid


def test_the_plan_of_a_schedule_is_its_motion():
    schedule = schedule_from_dict(planned())
    assert schedule.plan.makespan_s == pytest.approx(schedule.makespan_s)
    for event in schedule.events:
        there = schedule.plan.at(event.end_s)[event.arm]
        assert there == pytest.approx(schedule.trajectories[event.arm].at(np.array([event.end_s]))[0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data["trajectories"].pop("arm1"), "trajectories has no arm 'arm1'"),
        (lambda data: data["trajectories"]["arm1"]["times"].pop(), "trajectories.arm1 has"),
        (lambda data: data["trajectories"]["arm1"]["positions"][0].pop(), "positions[0] has 5 numbers; it must have 6"),
        (lambda data: data["events"][0].update(arm="amr0"), "unknown arm 'amr0'. Did you mean 'arm0'?"),
        (lambda data: data["events"][0].update(kind="mov"), "unknown kind of event 'mov'. Did you mean 'move'?"),
        (
            lambda data: data.update(margins={"arms": -1.0, "obstacles": 1.0, "self": 1.0}),
            "margins.arms is -1.0",
        ),
        (
            lambda data: data["margins"].update(arms=1e-320),
            "margins.arms is 1e-320; it must be a clearance in metres: 0, or 1e-12 or more; or null",
        ),
        (lambda data: data["proof"].update(arms=math.nan), "proof.arms is nan; it must be a clearance"),
        (lambda data: data.pop("proof"), "proof is missing"),
    ],
)
def test_a_fault_is_one_sentence(change, words):
    data = planned()
    change(data)
    with pytest.raises(MmpError) as error:
        schedule_from_dict(data, "schedule.json")
    assert words in str(error.value)
