"""The checker's clearance rules: contacts with obstacles, between arms and of an arm with itself, at every instant."""

import numpy as np
import pytest
from support import tiny_plans
from support.tiny_plans import REACHING, UPRIGHT

from mmp_env import check_plan
from mmp_env.check.models import CarriedModels


def broken(plan, *, exact=False):
    """Returns the rules that a plan breaks."""
    return {violation.rule for violation in check_plan(plan, exact=exact).violations}


OBSTACLES = {
    "box": {"shape": "box", "size": [0.1, 0.2, 0.1], "yaw": 0.3},
    "sphere": {"shape": "sphere", "radius": 0.05},
    "cylinder": {"shape": "cylinder", "radius": 0.05, "length": 0.2, "quaternion": [0.9, 0.1, 0.3, 0.2]},
    "capsule": {"shape": "capsule", "radius": 0.05, "length": 0.2, "quaternion": [0.9, 0.1, 0.3, 0.2]},
}


def swing(obstacle, *, center=0.0):
    """Returns a plan in which an outstretched arm swings about its base, past an obstacle."""
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
    """Returns a plan of two UR5e on the x axis, which reach towards each other if their first joints are 0."""
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


def test_an_arm_that_reaches_anothers_base_is_a_violation():
    low = [0.0, 0.1, 0.1, -0.2, 0.0, 0.0]
    (found,) = check_plan(facing({"left": [low], "right": [UPRIGHT]}, distance=0.9, times=[0.0])).violations
    assert found.values["things"] == ["left/forearm", "right/base"]
    assert broken(facing({"left": [low], "right": [UPRIGHT]}, distance=0.95, times=[0.0])) == set()


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


def test_the_checker_requires_half_the_margin_to_the_micrometre(monkeypatch):
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
    (found,) = check_plan(plan).violations
    assert found.rule == "arm-obstacle"
    assert found.values["found"], "it is met at an instant, not only feared"
    assert met <= found.values["clearance_m"] < met + 1e-6


def test_a_step_undecided_at_the_finest_resolution_is_not_proved(monkeypatch):
    plan = facing({"left": [UPRIGHT, [1.0, *UPRIGHT[1:]]], "right": [UPRIGHT, UPRIGHT]}, distance=0.45)
    assert check_plan(plan).valid
    monkeypatch.setattr("mmp_env.check.sweep.RESOLUTION_M", 1.0)
    monkeypatch.setattr("mmp_env.check.trajectory._STEP", 10.0)
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


def test_a_joint_that_may_turn_many_times_is_swept_completely(monkeypatch):
    monkeypatch.setitem(CarriedModels.read(None, None).robot("ur5e").data["joints"][0], "upper", 100.0)
    plan = swing({"name": "post", "shape": "sphere", "radius": 0.05, "position": [-0.65, 0.03, 0.45]})
    turns = [[0.5, *REACHING[1:]], [40.0, *REACHING[1:]]]
    plan |= {"positions": {"arm": turns}, "times": [0.0, 60.0]}
    plan["problem"] |= {"start": {"arm": turns[0]}, "goal": {"arm": turns[1]}}
    assert broken(plan) == {"arm-obstacle"}


def test_a_geom_of_a_shape_without_an_exact_check_proves_nothing(monkeypatch):
    monkeypatch.setattr("mmp_env.check.geoms.GEOM_KINDS", ())
    arms = [tiny_plans.arm("arm", [0.0, 0.0, 0.123])]  # a cell of its own, because the checker caches models of cells
    assert broken(tiny_plans.plan(arms, {"arm": [UPRIGHT]}, times=[0.0]), exact=True) == {"schema"}
