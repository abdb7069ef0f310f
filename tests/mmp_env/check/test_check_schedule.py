"""The checker of schedules finds planted faults."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from mmp_env import load_robot
from mmp_env.check.schedule import check_schedule_document
from tests.support.small_jobs import planned


def _event(data, job, step=0):
    return next(event for event in data["events"] if event.get("job") == job and event["step"] == step)


def _rows(data, arm):
    return data["trajectories"][arm]["positions"]


def _without(data, event):
    data["events"].remove(event)


def _contact(data):
    """Lets all arms stand at home, where they are in collision."""
    home = load_robot("ur5e").home.tolist()
    for arm in data["trajectories"]:
        data["trajectories"][arm]["positions"] = [list(home) for _ in _rows(data, arm)]
        data["start"][arm] = list(home)


def _jump(data):
    rows = _rows(data, "arm0")
    rows[len(rows) // 2][0] += 1.0


def _late(data):
    event = _event(data, "c")
    data["jobs"][2]["after"] = ["a", "b", "d"]
    event["time"] = 0.0


FAULTS = {
    "contact": (_contact, {"arm-arm"}),
    "jump": (_jump, {"speed"}),
    "start elsewhere": (lambda data: data["start"]["arm0"].__setitem__(0, 1.0), {"start"}),
    "beyond the limits": (lambda data: _rows(data, "arm0")[-1].__setitem__(0, 9.0), {"limits"}),
    "another goal": (lambda data: data["jobs"][0]["steps"][2].update(move="home"), {"goal"}),
    "another pose": (
        lambda data: data["jobs"][1]["steps"][0]["move"]["pose"].update(position=[0.0, -0.1, 0.601]),
        {"goal"},
    ),
    "another arm": (lambda data: data["jobs"][0].update(arm="arm1"), {"jobs"}),
    "a longer wait": (lambda data: data["jobs"][0]["steps"][1].update(wait=0.7), {"jobs"}),
    "one more step": (lambda data: data["jobs"][0]["steps"].append({"wait": 1.0}), {"jobs"}),
    "a step without event": (lambda data: _without(data, _event(data, "a", 1)), {"jobs"}),
    "a motion without event": (lambda data: _without(data, _event(data, "b")), {"jobs", "events"}),
    "a step done twice": (lambda data: data["events"].append(_event(data, "b")), {"jobs", "events"}),
    "a job before those it comes after": (_late, {"jobs", "events"}),
    "an event of another job": (lambda data: _event(data, "a").update(job="z"), {"events", "jobs"}),
    "an event of another arm": (lambda data: _event(data, "a").update(arm="arm9"), {"events", "jobs"}),
    "an event after the end": (lambda data: _event(data, "a", 2).update(until=1e3), {"events"}),
    "a move called a wait": (lambda data: _event(data, "a").update(kind="wait"), {"jobs"}),
    "larger margins": (lambda data: data["margins"].update(self=0.02), {"self"}),
    "no times": (lambda data: data["trajectories"]["arm0"].update(times=[]), {"times", "shape"}),
    "times that do not ascend": (lambda data: data["trajectories"]["arm0"]["times"].reverse(), {"times"}),
    "no arm": (lambda data: data["trajectories"].pop("arm0"), {"schema"}),
    "an unknown field": (lambda data: data.update(objects=[]), {"schema"}),
    "a file of another kind": (lambda data: data.update(schema="mmp-plan/1"), {"schema"}),
}


def test_a_planned_schedule_is_valid():
    report = check_schedule_document(planned())
    assert report.valid, report.sentences
    assert report.min_clearance_m >= 0.002


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found(name):
    data = copy.deepcopy(planned())
    plant, rules = FAULTS[name]
    plant(data)
    report = check_schedule_document(data)
    assert not report.valid
    assert {violation.rule for violation in report.violations} & rules, report.sentences


def test_any_joint_that_moves_at_rest_is_found():
    rng = np.random.default_rng(0)
    for _ in range(20):
        data = planned()
        arm = str(rng.choice(list(data["trajectories"])))
        rows = _rows(data, arm)
        rows[-1][int(rng.integers(6))] += 0.01
        assert not check_schedule_document(data).valid
