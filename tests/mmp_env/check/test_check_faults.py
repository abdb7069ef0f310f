"""Faults in a planner's model of the cell: its plan is valid in that model, and the checker refutes it."""

import pytest
from support import tiny_plans
from support.tiny_plans import REACHING, UPRIGHT

from mmp_env import check_plan

EXACT = pytest.mark.parametrize("exact", [False, True])


def rules(plan, exact):
    return {violation.rule for violation in check_plan(plan, exact=exact).violations}


def in_cell(plan, change):
    """Returns the plan with another copy of its cell."""
    other = tiny_plans.copy_of(plan)
    change(other["problem"]["cell"])
    return other


@EXACT
def test_a_base_turned_by_90_degrees_is_caught(exact):
    arms = [tiny_plans.arm("left", [0.0, 0.0, 0.0], yaw=3.1416), tiny_plans.arm("right", [1.3, 0.0, 0.0], yaw=1.5708)]
    swing = [[pan, *REACHING[1:]] for pan in (-0.8, 0.5)]
    planned = tiny_plans.plan(arms, {"left": swing, "right": [REACHING, REACHING]})
    assert rules(planned, exact) == set()
    assert rules(in_cell(planned, lambda cell: cell["arms"][1].update(yaw=0.0)), exact) == {"arm-arm"}


@EXACT
def test_two_joints_swapped_are_caught(exact):
    table = {"name": "table", "shape": "box", "size": [3.0, 3.0, 0.1], "position": [0.0, 0.0, -0.05]}
    planned = tiny_plans.plan(
        [tiny_plans.arm("arm", [0.0, 0.0, 0.0])],
        {"arm": [UPRIGHT, [0.5, -1.6, 0.9, -1.5, 0.0, 0.0]]},
        obstacles=[table],
    )
    assert rules(planned, exact) == set()
    real = tiny_plans.copy_of(planned)  # joint 2 of the planner is joint 3 of the robot
    for rows in (real["positions"]["arm"], [real["problem"]["start"]["arm"]], [real["problem"]["goal"]["arm"]]):
        for row in rows:
            row[1], row[2] = row[2], row[1]
    assert "arm-obstacle" in rules(real, exact)


@EXACT
def test_a_tool_left_off_is_caught(exact):
    home = [0.0, -0.7854, 0.0, -2.3562, 0.0, 1.5708, 0.7854]
    shelf = {"name": "shelf", "shape": "box", "size": [0.4, 0.4, 0.02], "position": [0.35, 0.0, 0.5]}
    planned = tiny_plans.plan(
        [tiny_plans.arm("arm", [0.0, 0.0, 0.0], robot="panda")],
        {"arm": [home, [0.4, *home[1:]]]},
        obstacles=[shelf],
    )
    assert rules(planned, exact) == set()
    real = in_cell(planned, lambda cell: cell["arms"][0].update(tool="franka-hand"))
    assert rules(real, exact) == {"arm-obstacle"}
    (found,) = check_plan(real, exact=exact).violations
    assert found.values["things"] == ["arm/franka-hand", "obstacle/shelf"]
    unsaid = in_cell(real, lambda cell: cell["arms"][0].pop("tool"))
    assert rules(unsaid, exact) == {"arm-obstacle"}, "a panda has its hand unless the file says otherwise"


@EXACT
def test_an_arm_placed_elsewhere_is_caught(exact):
    arms = [tiny_plans.arm("left", [0.0, 0.0, 0.0], yaw=3.1416), tiny_plans.arm("right", [1.9, 0.0, 0.0])]
    swing = [[pan, *REACHING[1:]] for pan in (-0.8, 0.5)]
    planned = tiny_plans.plan(arms, {"left": swing, "right": [REACHING, REACHING]})
    assert rules(planned, exact) == set()
    assert rules(in_cell(planned, lambda cell: cell["arms"][1].update(position=[1.4, 0.0, 0.0])), exact) == {"arm-arm"}


@EXACT
def test_an_obstacle_left_out_is_caught(exact):
    planned = tiny_plans.plan([tiny_plans.arm("arm", [0.0, 0.0, 0.0])], {"arm": [UPRIGHT, REACHING]})
    wall = {"name": "wall", "shape": "box", "size": [0.1, 2.0, 2.0], "position": [-0.6, 0.0, 1.0]}
    assert rules(planned, exact) == set()
    assert rules(in_cell(planned, lambda cell: cell["obstacles"].append(wall)), exact) == {"arm-obstacle"}


def test_clocks_that_are_not_common_are_caught():
    """Two arms take turns in the middle, and the clock of one arm is late."""
    arms = [tiny_plans.arm("left", [0.0, 0.0, 0.0], yaw=3.1416), tiny_plans.arm("right", [1.3, 0.0, 0.0])]
    out, middle = [-1.2, *REACHING[1:]], REACHING
    turns = {"left": [out, middle, out, out, out], "right": [out, out, out, middle, out]}
    assert rules(tiny_plans.plan(arms, turns), False) == set()
    late = {"left": [out, out, out, middle, out], "right": turns["right"]}
    assert rules(tiny_plans.plan(arms, late), False) == {"arm-arm"}
