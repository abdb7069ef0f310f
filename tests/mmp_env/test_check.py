"""The checker, rule by rule: a plan with nothing wrong, and the same with one thing wrong."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
import tiny_plans
from tiny_plans import REACHING, UPRIGHT

import mmp_env.check
from mmp_env.check import RULES, check_plan
from mmp_env.plan_file import plan_from_dict


def broken(plan, *, exact=False):
    """The rules that a plan breaks."""
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


def test_a_plan_object_and_its_file_have_the_same_report():
    plan = tiny_plans.two_apart()
    assert check_plan(plan_from_dict(plan)).as_dict() == check_plan(plan).as_dict()


def test_a_plan_of_one_configuration_is_valid_when_it_starts_at_its_goal():
    plan = tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT]}, times=[0.0])
    assert check_plan(plan).valid


def test_nothing_of_the_planners_geometry_is_imported_by_the_checker():
    allowed = {"mmp_env.plan", "mmp_env.plan_file", "mmp_env.mujoco_import"}
    for file in Path(mmp_env.check.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            ours = {name for name in names if name.startswith("mmp_") and not name.startswith("mmp_env.check")}
            assert ours <= allowed, f"{file.name} imports {ours - allowed}"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["position", "time", "goal"])
def test_a_number_that_is_none_is_a_violation(value, where):
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


def test_the_robots_own_velocity_holds_where_the_problem_asks_for_more():
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


OBSTACLES = {
    "box": {"shape": "box", "size": [0.1, 0.2, 0.1], "yaw": 0.3},
    "sphere": {"shape": "sphere", "radius": 0.05},
    "cylinder": {"shape": "cylinder", "radius": 0.05, "length": 0.2, "quaternion": [0.9, 0.1, 0.3, 0.2]},
    "capsule": {"shape": "capsule", "radius": 0.05, "length": 0.2, "quaternion": [0.9, 0.1, 0.3, 0.2]},
}


def swing(obstacle, *, center=0.0):
    """An outstretched arm that swings about its base, past an obstacle."""
    start, end = ([center + pan, *REACHING[1:]] for pan in (-0.5, 0.5))
    return tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [start, end]}, obstacles=[obstacle])


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("shape", OBSTACLES)
def test_an_obstacle_that_is_hit_strictly_between_two_samples_is_a_violation(shape, exact):
    there = OBSTACLES[shape] | {"name": "post", "position": [-0.65, 0.03, 0.45]}
    plan = swing(there)
    ends = [{**plan, "positions": {"arm": [q]}, "times": [0.0]} for q in plan["positions"]["arm"]]
    assert all("arm-obstacle" not in broken(end, exact=exact) for end in ends)
    (found,) = check_plan(plan, exact=exact).violations
    assert found.rule == "arm-obstacle"
    assert found.arms == ("arm",)
    assert found.values["things"][1] == "obstacle/post"
    assert 0.0 < found.time_s < plan["times"][-1]
    away = there | {"position": [-0.65, 0.0, 1.3]}
    assert broken(swing(away), exact=exact) == set()


def test_the_base_is_not_tested_against_obstacles_but_the_links_are():
    floor = {"name": "floor", "shape": "box", "size": [2.0, 2.0, 0.2], "position": [0.0, 0.0, -0.1]}
    still = tiny_plans.plan(
        [tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT]}, times=[0.0], obstacles=[floor]
    )
    assert broken(still) == set()
    floor["position"] = [0.0, 0.0, 0.03]
    assert broken(
        tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT]}, times=[0.0], obstacles=[floor])
    ) == {"arm-obstacle"}


def facing(positions, *, distance=1.3, times=None):
    """Two UR5e on the x axis that reach towards each other where their first joints are 0."""
    arms = [tiny_plans.arm("left", [0.0, 0.0, 0.0], yaw=np.pi), tiny_plans.arm("right", [distance, 0.0, 0.0])]
    return tiny_plans.plan(arms, positions, times=times)


@pytest.mark.parametrize("exact", [False, True])
def test_arms_that_meet_strictly_between_two_samples_are_a_violation(exact):
    start, end = ([pan, *REACHING[1:]] for pan in (-0.8, 0.5))
    plan = facing({"left": [start, end], "right": [REACHING, REACHING]})
    ends = [facing({"left": [q], "right": [REACHING]}, times=[0.0]) for q in (start, end)]
    assert all(broken(plan, exact=exact) == set() for plan in ends)
    (found,) = check_plan(plan, exact=exact).violations
    assert found.rule == "arm-arm"
    assert set(found.arms) == {"left", "right"}
    assert found.values["clearance_m"] < 0.0
    assert 0.0 < found.values["from_s"] <= found.time_s <= found.values["to_s"] < plan["times"][-1]
    assert broken(facing({"left": [start, end], "right": [UPRIGHT, UPRIGHT]}), exact=exact) == set()


def test_an_arm_that_moves_into_anothers_base_is_a_violation():
    low = [0.0, -0.1, 0.1, -0.3, 0.0, 0.0]
    plan = facing({"left": [low], "right": [UPRIGHT]}, distance=0.75, times=[0.0])
    things = [violation.values["things"] for violation in check_plan(plan).violations]
    assert any("right/base" in pair or "right/shoulder" in pair for pair in things)


@pytest.mark.parametrize("exact", [False, True])
def test_an_arm_that_folds_into_itself_is_a_violation(exact):
    folded = [0.0, -1.5708, 3.1, -1.5708, 0.0, 0.0]
    plan = tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT, folded]})
    report = check_plan(plan, exact=exact)
    assert {violation.rule for violation in report.violations} == {"self"}
    assert report.violations[0].arms == ("arm",)
    assert report.min_clearance_m is None


def test_all_violations_are_reported_not_only_the_first():
    start, end = ([pan, *REACHING[1:]] for pan in (-0.8, 0.5))
    plan = facing({"left": [start, end], "right": [REACHING, REACHING]}, times=[0.0, 0.5])
    plan["problem"]["goal"]["right"][0] = 0.1
    plan["problem"]["start"]["left"][0] = 0.1
    assert broken(plan) == {"start", "goal", "speed", "arm-arm"}


def test_half_the_margin_is_what_has_to_be_proved_to_the_micrometre(monkeypatch):
    plan = swing({"name": "post", "shape": "sphere", "radius": 0.05, "position": [-0.65, 0.03, 0.6]})
    pans = np.linspace(-0.1, -0.02, 41)
    stops = [plan | {"positions": {"arm": [[pan, *REACHING[1:]]]}, "times": [0.0]} for pan in pans.tolist()]
    at_stops = min(check_plan(stop).found_clearance_m for stop in stops)
    with monkeypatch.context() as patched:
        patched.setattr("mmp_env.check.sweep._SLACK_M", 1e-7)
        patched.setattr("mmp_env.check.sweep._SLACK_SHARE", 0.0)
        met = check_plan(plan).found_clearance_m
    assert 1e-3 < met <= at_stops <= met + 1e-5
    plan["problem"]["margin"] = 2 * (met - 1e-6)
    report = check_plan(plan)
    assert report.valid
    assert met - 1e-6 <= report.min_clearance_m <= met
    plan["problem"]["margin"] = 2 * (met + 1e-6)
    assert broken(plan) == {"arm-obstacle"}


def test_what_is_still_open_at_the_resolution_is_not_proved(monkeypatch):
    plan = facing({"left": [UPRIGHT, [1.0, *UPRIGHT[1:]]], "right": [UPRIGHT, UPRIGHT]}, distance=0.45)
    assert check_plan(plan).valid
    monkeypatch.setattr("mmp_env.check.sweep.RESOLUTION_M", 1.0)
    monkeypatch.setattr("mmp_env.check.path._STEP_RAD", 10.0)
    found = check_plan(plan).violations
    assert found
    assert all("not proved" in violation.message for violation in found)


def test_a_motion_far_out_of_all_limits_is_not_swept():
    plan = tiny_plans.two_apart()
    plan["positions"]["left"][1][2] = 1e300
    report = check_plan(plan)
    assert {"limits", "speed"} <= {violation.rule for violation in report.violations}
    assert report.min_clearance_m is None
    assert report.instants == 0


def test_checking_twice_gives_the_same_report():
    plan = tiny_plans.two_apart()
    assert check_plan(plan).as_dict() == check_plan(plan).as_dict()
