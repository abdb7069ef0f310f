"""The checker, rule by rule: a valid plan, and copies with one fault each."""

import json

import mujoco
import numpy as np
import pytest
from support import tiny_plans, unchecked
from support.tiny_plans import UPRIGHT

from mmp_env import MmpError, check_plan
from mmp_env.check import RULES
from mmp_env.check.episode import check_episode
from mmp_env.files.plan_file import plan_from_dict


def broken(plan, *, exact=False):
    """Returns the rules that a plan breaks."""
    report = check_plan(plan, exact=exact)
    assert all(violation.rule in RULES and violation.message for violation in report.violations)
    json.dumps(report.as_dict(), allow_nan=False)
    return {violation.rule for violation in report.violations}


@pytest.mark.parametrize("exact", [False, True])
def test_a_good_plan_is_valid_and_its_clearance_is_proved(exact):
    report = check_plan(tiny_plans.two_apart(), exact=exact)
    assert report.valid
    assert report.violations == ()
    assert report.required_m < report.min_clearance_m <= report.found_clearance_m
    assert report.spheres == ("geoms" if exact else "28")
    assert " and " in report.where
    assert "mm" in str(report)


def test_too_little_memory_is_no_violation(monkeypatch):
    class Starved(mujoco.MjSpec):
        def compile(self):
            raise ValueError("Error: engine error: Could not allocate memory")

    plan = tiny_plans.two_apart()
    plan["problem"]["cell"]["arms"][0]["position"][2] += 0.0123  # no other test compiles this cell
    monkeypatch.setattr(mujoco, "MjSpec", Starved)
    with pytest.raises(MemoryError, match="MuJoCo got no memory"):
        check_plan(plan)


def test_a_report_of_a_valid_plan_is_true():
    good = tiny_plans.two_apart()
    bad = good | {"times": [t + 1.0 for t in good["times"]]}
    assert check_plan(good)
    assert not check_plan(bad)
    episode = {"schema": "mmp-episode/1", "plans": [good]}
    assert check_episode(episode)
    assert not check_episode(episode | {"plans": [bad]})


def test_a_plan_object_and_its_file_have_the_same_report():
    plan = tiny_plans.two_apart()
    plan["problem"]["margins"] = {"arms": 0.002, "obstacles": 0.001, "self": 0.0015}
    assert check_plan(plan_from_dict(plan)).as_dict() == check_plan(plan).as_dict()


def test_a_plan_of_one_configuration_is_valid_when_it_starts_at_its_goal():
    plan = tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT]}, times=[0.0])
    assert check_plan(plan).valid


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["position", "time", "goal"])
def test_a_value_that_is_no_number_is_a_violation(value, where):
    plan = tiny_plans.two_apart()
    rows = {
        "position": plan["positions"]["left"][1],
        "time": plan["times"],
        "goal": plan["problem"]["goal"]["right"],
    }
    rows[where][2] = value
    assert broken(plan) == {"finite"}


@pytest.mark.parametrize(
    "times", [[0.0, 2.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 2.0], [0.1, 1.5, 3.0], [-1.0, 1.0, 3.0]]
)
def test_times_that_do_not_ascend_from_zero_are_a_violation(times):
    assert "times" in broken(tiny_plans.two_apart() | {"times": times})


def test_another_start_than_the_problems_is_a_violation():
    plan = tiny_plans.two_apart()
    plan["problem"]["start"]["right"][3] += 2e-6
    assert broken(plan) == {"start"}


def test_a_stop_short_of_the_goal_is_a_violation():
    plan = tiny_plans.two_apart()
    plan["positions"]["left"][-1][4] -= 2e-6
    assert broken(plan) == {"goal"}
    plan["positions"]["left"][-1][4] += 1.5e-6
    assert broken(plan) == set()


def test_a_plan_that_was_cut_off_stops_short_of_the_goal_of_every_arm():
    plan = tiny_plans.two_apart()
    plan["times"].pop()
    for rows in plan["positions"].values():
        rows.pop()
    report = check_plan(plan)
    assert {(violation.rule, *violation.arms) for violation in report.violations} == {
        ("goal", "left"),
        ("goal", "right"),
    }


def test_a_joint_beyond_its_limit_is_a_violation_that_names_it():
    plan = tiny_plans.two_apart()
    plan["positions"]["left"][1][2] = -3.1416
    report = check_plan(plan | {"times": [0.0, 5.0, 10.0]})
    (found,) = [violation for violation in report.violations if violation.rule == "limits"]
    assert found.arms == ("left",)
    assert found.values["joint"] == 3
    assert found.time_s == 5.0


def test_a_joint_that_is_too_fast_is_a_violation_that_names_it():
    plan = tiny_plans.two_apart()
    plan["times"][2] -= 1e-6
    (found,) = check_plan(plan).violations
    assert found.rule == "speed"
    assert found.values["value"] == pytest.approx(0.8, rel=1e-5)
    assert found.values["value"] > 0.8


def test_the_robots_velocity_limit_holds_if_the_problem_has_a_higher_one():
    fast = tiny_plans.plan(
        [tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT, [0.5, *UPRIGHT[1:]]]}, times=[0.0, 0.155]
    )
    fast["problem"]["max_velocity"] = 10.0
    assert broken(fast) == {"speed"}
    assert broken(fast | {"times": [0.0, 0.16]}) == set()


def test_velocities_may_be_given_for_every_joint():
    plan = tiny_plans.two_apart()
    plan["problem"]["max_velocity"] = {"left": [0.8] * 6, "right": [0.8, 0.8, 0.8, 0.8, 0.8, 0.2]}
    (found,) = check_plan(plan).violations
    assert (found.rule, found.arms, found.values["joint"]) == ("speed", ("right",), 6)


def test_checking_twice_gives_the_same_report():
    plan = tiny_plans.two_apart()
    assert check_plan(plan).as_dict() == check_plan(plan).as_dict()


def test_a_flag_that_is_no_truth_value_is_refused():
    with unchecked.unchecked(), pytest.raises(MmpError, match="exact is 'no'; it must be True or False"):
        check_plan({}, exact="no")
