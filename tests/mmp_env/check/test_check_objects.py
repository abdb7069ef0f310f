"""The checker finds planted faults of grasps, releases and objects."""

from __future__ import annotations

import numpy as np
import pytest

from mmp_env.check.schedule import check_schedule_document
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import schedule
from tests.support.object_jobs import planned, work


def _event(data, kind, what):
    return next(event for event in data["events"] if event["kind"] == kind and event["object"] == what)


def _rules(data):
    return {violation.rule for violation in check_schedule_document(data).violations}


def _shift(data, index, *by):
    position = data["objects"][index]["position"]
    data["objects"][index]["position"] = [a + b for a, b in zip(position, by, strict=True)]


def _left_out(data):
    """Leaves out the last object, which another one is put on."""
    data["objects"].pop()


def _in_the_way(data):
    """Adds an object where the red one is put down for the other arm."""
    data["objects"].append({"name": "grey", "shape": "box", "size": [0.05, 0.05, 0.1], "position": [0.03, 0.0, 0.05]})


def _without(data, event):
    data["events"].remove(event)


def _unordered(data):
    data["order"].clear()
    data["order_past_s"].clear()


def _early(data):
    """Lets the line before a release end early, so that the object is released in the air."""
    event = _event(data, "release", "red")
    line = next(e for e in data["events"] if e["arm"] == event["arm"] and e["until"] == event["time"])
    line["until"] = event["time"] = round(event["time"] - 0.3, 9)


def _swap(data):
    for event in data["events"]:
        if event.get("object") in ("red", "blue"):
            event["object"] = {"red": "blue", "blue": "red"}[event["object"]]


FAULTS = {
    "an object that is elsewhere": (lambda data: _shift(data, 0, 0.05, 0.0, 0.0), {"objects"}),
    "an object that is a little elsewhere": (lambda data: _shift(data, 0, 0.002, 0.0, 0.0), {"objects"}),
    "an object in the air": (lambda data: _shift(data, 0, 0.0, 0.0, 0.01), {"objects"}),
    "an object that is left out": (_left_out, {"objects"}),
    "an object that was added": (_in_the_way, {"arm-obstacle"}),
    "a larger object": (lambda data: data["objects"][0].update(size=[0.05, 0.05, 0.11]), {"objects"}),
    "a wider object": (
        lambda data: data["objects"][0].update(size=[0.4, 0.4, 0.1]),
        {"arm-obstacle", "arm-arm", "self"},
    ),
    "another pose of a release": (
        lambda data: _event(data, "release", "red")["pose"]["position"].__setitem__(0, 0.001),
        {"objects"},
    ),
    "a release that is left out": (lambda data: _without(data, _event(data, "release", "red")), {"jobs"}),
    "a grasp that is left out": (lambda data: _without(data, _event(data, "grasp", "red")), {"jobs"}),
    "a grasp of another object": (_swap, {"jobs", "objects"}),
    "a grasp of an unknown object": (
        lambda data: _event(data, "grasp", "red").update(object="rad"),
        {"jobs", "objects"},
    ),
    "a release in the air": (_early, {"objects", "events", "jobs", "line"}),
    "no order": (_unordered, {"order"}),
    "a grasp without a pose": (lambda data: _event(data, "grasp", "red").pop("pose"), {"schema"}),
    "two objects of one name": (lambda data: data["objects"][1].update(name="red"), {"schema"}),
    "a mesh": (lambda data: data["objects"][0].update(shape="mesh"), {"schema"}),
}


def test_a_planned_schedule_is_valid():
    report = check_schedule_document(planned())
    assert report.valid, report.sentences
    assert report.min_clearance_m >= 0.002


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found(name):
    plant, rules = FAULTS[name]
    data = planned()
    plant(data)
    found = _rules(data)
    assert found & rules, found


def test_no_pair_of_the_order_can_be_left_out():
    for number in range(len(planned()["order"])):
        data = planned()
        del data["order"][number], data["order_past_s"][number]
        assert _rules(data) == {"order"}, number


def test_held_objects_that_touch_are_found():
    data = planned()
    for solid in data["objects"][:2]:
        solid["size"][:2] = [0.25, 0.25]
    sentences = check_schedule_document(data).sentences
    assert any("arm0/held and arm1/held overlap" in sentence for sentence in sentences)


def test_objects_of_the_file_are_those_of_the_jobs():
    data = planned()
    assert [each["name"] for each in data["objects"]] == ["red", "blue", "green"]
    assert np.allclose(_event(data, "grasp", "red")["pose"]["position"], data["objects"][0]["position"])


def test_objects_beside_arms_that_never_move_are_checked():
    done = schedule(jobs_from_dict(work({"name": "stay", "steps": [{"move": "tucked"}]}), "jobs.json"))
    data = schedule_to_dict(done.schedule)
    report = check_schedule_document(data)
    assert report.valid, report.sentences
    assert report.min_clearance_m >= 0.002
    data["objects"][0] |= {"position": [0.5, 0.0, 0.3], "size": [0.1, 0.1, 0.6]}
    assert _rules(data) == {"arm-obstacle"}
