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


def _window(data, job, step=0):
    """Returns the samples of a step and the numbers of their first and last period."""
    event = _event(data, job, step)
    arm, period = event["arm"], data["period_s"]
    return data["trajectories"][arm], round(event["time"] / period), round(event["until"] / period)


def _bent(data):
    """Moves one sample in the middle of a motion by as little as no limit of speed forbids."""
    track, begin, end = _window(data, "a")
    periods = [round(time / data["period_s"]) for time in track["times"]]
    track["positions"][periods.index((begin + end) // 2)][2] += 0.003


def _pair(data, index=0):
    return data["order"][index]


def _unordered(data):
    data["order"].clear()
    data["order_past_s"].clear()


def _unordered_with_hardly_a_margin(data):
    _unordered(data)
    for job in data["jobs"]:
        job["after"] = []
    data["margins"] = dict.fromkeys(data["margins"], 5e-10)


def _slow_limits(data, key, share):
    for arm in data[key]:
        data[key][arm] = [share * limit for limit in data[key][arm]]


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
    "an event that never ends": (lambda data: _event(data, "a", 2).update(until=np.inf), {"finite"}),
    "an event that begins after all times": (lambda data: _event(data, "a", 2).update(time=1e300), {"events"}),
    "a move called a wait": (lambda data: _event(data, "a").update(kind="wait"), {"jobs"}),
    "larger margins": (lambda data: data["margins"].update(self=0.02), {"self"}),
    "a sample beside its path": (_bent, {"acceleration", "jerk"}),
    "lower accelerations": (lambda data: _slow_limits(data, "max_acceleration", 0.5), {"acceleration"}),
    "lower jerks": (lambda data: _slow_limits(data, "max_jerk", 0.01), {"jerk"}),
    "no order": (_unordered, {"order"}),
    "no order and hardly a margin": (_unordered_with_hardly_a_margin, {"order"}),
    "an order of too early a point": (lambda data: data["order_past_s"].__setitem__(0, 0.05), {"order"}),
    "an order that the times break": (lambda data: data["order_past_s"].__setitem__(0, 1.3), {"order"}),
    "an order of a point that is never reached": (lambda data: data["order_past_s"].__setitem__(0, 9.0), {"order"}),
    "an order the other way round": (lambda data: _pair(data).reverse(), {"order"}),
    "an order of an unknown motion": (lambda data: _pair(data)[0].__setitem__(1, 99), {"order"}),
    "an order of one arm": (lambda data: _pair(data)[0].__setitem__(0, _pair(data)[1][0]), {"order"}),
    "an order without times": (lambda data: data["order_past_s"].clear(), {"shape"}),
    "a group of one arm": (lambda data: _event(data, "a").update(group=1), {"order"}),
    "times beside the period": (lambda data: data["trajectories"]["arm0"]["times"].__setitem__(1, 0.013), {"times"}),
    "another period": (lambda data: data.update(period_s=0.01), {"acceleration", "events"}),
    "no times": (lambda data: data["trajectories"]["arm0"].update(times=[]), {"times", "shape"}),
    "times that do not ascend": (lambda data: data["trajectories"]["arm0"]["times"].reverse(), {"times"}),
    "no arm": (lambda data: data["trajectories"].pop("arm0"), {"schema"}),
    "an unknown field": (lambda data: data.update(things=[]), {"schema"}),
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


def test_no_pair_of_the_order_can_be_left_out():
    for lines in (False, True):
        for number in range(len(planned(lines)["order"])):
            data = planned(lines)
            del data["order"][number], data["order_past_s"][number]
            assert {violation.rule for violation in check_schedule_document(data).violations} == {"order"}


LINE_FAULTS = {
    "another line": lambda data: data["jobs"][0]["steps"][1].update(line=[0.0, 0.0, -0.101]),
    "an oblique line": lambda data: data["jobs"][0]["steps"][3].update(line=[0.002, 0.0, 0.1]),
    "a line of no length": lambda data: data["jobs"][0]["steps"][1].update(line=[0.0, 0.0, 0.0]),
    "a line beyond all numbers": lambda data: data["jobs"][0]["steps"][1].update(line=[np.nan, 0.0, -0.1]),
    "a line that ends after all times": lambda data: _event(data, "a", 1).update(until=1e300),
    "a move called a line": lambda data: _event(data, "a").update(kind="line"),
    "a line that ends early": lambda data: _event(data, "a", 1).update(until=_event(data, "a", 1)["until"] - 0.2),
}


def test_lines_are_straight():
    report = check_schedule_document(planned(lines=True))
    assert report.valid, report.sentences


@pytest.mark.parametrize("name", LINE_FAULTS)
def test_a_planted_fault_of_a_line_is_found(name):
    data = planned(lines=True)
    LINE_FAULTS[name](data)
    rules = {violation.rule for violation in check_schedule_document(data).violations}
    assert rules & {"line", "jobs", "events", "schema"}


def test_a_tool_that_leaves_its_line_between_its_ends_is_found():
    data = planned(lines=True)
    track, begin, end = _window(data, "a", 1)
    steps = np.round(np.array(track["times"]) / data["period_s"])
    every = np.arange(steps[-1] + 1)
    rows = np.column_stack([np.interp(every, steps, column) for column in np.array(track["positions"]).T])
    share = np.arange(end - begin + 1) / (end - begin)
    rows[begin : end + 1, 0] += 0.005 * (1 - np.cos(2 * np.pi * share))  # some millimetres at the tool
    track.update(times=(data["period_s"] * every).tolist(), positions=rows.tolist())
    rules = {violation.rule for violation in check_schedule_document(data).violations}
    assert "line" in rules


def test_any_joint_that_moves_at_rest_is_found():
    rng = np.random.default_rng(0)
    for _ in range(20):
        data = planned()
        arm = str(rng.choice(list(data["trajectories"])))
        rows = _rows(data, arm)
        rows[-1][int(rng.integers(6))] += 0.01
        assert not check_schedule_document(data).valid


@pytest.mark.parametrize("kind", ["arms", "obstacles", "self"])
def test_a_stated_clearance_that_the_motion_does_not_have_is_found(kind):
    data = planned()
    found = check_schedule_document(data).found_m[kind]
    assert data["proof"][kind] <= found
    data["proof"][kind] = found + 2e-6
    (violation,) = check_schedule_document(data).violations
    assert violation.rule == "proof"
    assert f"proof.{kind} is" in violation.message
    assert check_schedule_document(data, exact=True).valid
    data["proof"][kind] = "wide"
    assert not check_schedule_document(data, exact=True).valid
