"""Episodes: plans in a row as a file, checked and executed."""

import json

import pytest
from support import tiny_plans

from mmp_env.check.episode import check_episode
from mmp_env.errors import MmpError
from mmp_env.files.episode_file import episode_from_dict, episode_to_dict, load_episode, save_episode
from mmp_env.sim.episode_execution import execute_episode

BOX = {"shape": "box", "position": [0, 0, 0.1], "size": [0.04, 0.04, 0.06]}


def episode():
    """Returns an episode of two plans: the arm reaches out, and returns with an object in its tool."""
    arms = [tiny_plans.arm("left", [0, 0, 0]), tiny_plans.arm("right", [0, 1.0, 0])]
    there = {name: [tiny_plans.UPRIGHT, tiny_plans.REACHING] for name in ("left", "right")}
    back = {name: rows[::-1] for name, rows in there.items()}
    plans = [tiny_plans.plan(arms, there), tiny_plans.plan(arms, back)]
    plans[1]["problem"]["cell"]["arms"][0]["held"] = BOX
    return {"schema": "mmp-episode/1", "name": "there-and-back", "plans": plans}


def test_an_episode_of_valid_plans_that_fit_together_is_valid():
    report = check_episode(episode())
    assert report.valid, str(report)
    assert [plan.valid for plan in report.plans] == [True, True]
    assert report.min_clearance_m == min(plan.min_clearance_m for plan in report.plans)
    assert str(report).count("valid; clearance") == 2
    assert report.as_dict()["valid"] is True


def test_a_jump_between_two_plans_is_a_violation():
    data = episode()
    for place in ("start", "positions"):
        values = (data["plans"][1]["problem"] if place == "start" else data["plans"][1])[place]["right"]
        (values if place == "start" else values[0])[2] += 0.01
    report = check_episode(data)
    assert not report.valid
    assert all(plan.valid for plan in report.plans)
    (violation,) = report.violations
    assert (violation.rule, violation.arms, violation.values["joint"]) == ("start", ("right",), 3)
    assert "plan 1 does not go on from plan 0: arm 'right', joint 3, begins 0.01 rad from where it ended" in str(report)


def test_arms_that_stand_elsewhere_are_a_violation():
    data = episode()
    data["plans"][1]["problem"]["cell"]["arms"][1]["position"] = [0, 1.1, 0]
    (violation,) = check_episode(data).violations
    assert "its arms are others, or stand elsewhere" in violation.message


def test_a_base_may_be_turned_by_a_yaw_in_one_plan_and_by_a_quaternion_in_the_next():
    data = episode()
    arm = data["plans"][1]["problem"]["cell"]["arms"][1]
    arm["yaw"] = None
    arm["quaternion"] = [-1.0, 0.0, 0.0, 0.0]
    assert check_episode(data).valid


def test_every_violation_of_an_episode_names_its_plan():
    data = episode()
    data["plans"][1]["times"][0] = 0.5
    data["plans"][1]["problem"]["goal"]["left"][0] += 0.1
    report = check_episode(data)
    assert len(report.sentences) > 1
    assert all(line.startswith("plan 1: ") for line in str(report).splitlines())


def test_an_episode_with_an_invalid_plan_is_invalid():
    data = episode()
    data["plans"][0]["times"][0] = 0.5
    report = check_episode(data)
    assert not report.valid
    assert [plan.valid for plan in report.plans] == [False, True]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([], "is not a JSON object"),
        ({"schema": "mmp-plan/1", "plans": []}, "this checker reads 'mmp-episode/1'"),
        ({"schema": "mmp-episode/1", "plans": []}, "no plans"),
        ({"schema": "mmp-episode/1", "plans": {}}, "not a list"),
        ({"schema": "mmp-episode/1", "plans": [1]}, "not a JSON object"),
        ({"schema": "mmp-episode/1", "plans": [{}], "more": 1}, "does not know"),
    ],
)
def test_data_that_are_no_episode_are_a_violation_and_no_error(data, words):
    report = check_episode(data)
    assert not report.valid
    assert words in str(report)


def test_an_episode_reads_back_the_same(tmp_path):
    made = episode_from_dict(episode())
    assert made.makespan_s == pytest.approx(2 * made.plans[0].makespan_s)
    path = tmp_path / "out.json"
    save_episode(made, path)
    again = load_episode(path)
    assert episode_to_dict(again) == episode_to_dict(made)
    assert again.plans[1].problem.cell.arms[0].held.name == "held"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda data: data.update(plans=[]), "file.json: plans is empty"),
        (lambda data: data.update(name="a/b"), "file.json: name is 'a/b'"),
        (lambda data: data["plans"][1].pop("times"), r"file.json: plans\[1\].times is missing"),
        (lambda data: data.update(schema="mmp-plan/1"), "file.json: schema is 'mmp-plan/1'"),
        (lambda data: data.update(length=2), "unknown field 'length'"),
    ],
)
def test_a_bad_file_is_named_with_field_and_value(spoil, words):
    data = episode()
    spoil(data)
    with pytest.raises(MmpError, match=words):
        episode_from_dict(data, "file.json")


def test_a_file_name_that_cannot_be_the_name_of_an_episode_is_refused_as_one(tmp_path):
    path = tmp_path / f"{'a' * 150}.json"
    path.write_text(json.dumps(episode() | {"name": None}))
    with pytest.raises(MmpError, match=r"name is missing, and the file's own name '.*' cannot stand in for it"):
        load_episode(path)


def test_an_episode_is_executed_as_one_run_from_where_the_arms_stand():
    execution = execute_episode(episode_from_dict(episode()))
    first, second = execution.reports
    assert execution.reached
    assert execution.contacts == 0
    for arm in ("left", "right"):
        assert second.positions[arm][0].tolist() == first.positions[arm][-1].tolist()
    assert execution.duration_s == pytest.approx(first.duration_s + second.duration_s)
