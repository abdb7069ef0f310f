"""The checker's rule that each arm ends at something that was asked for."""

import dataclasses

import numpy as np
import pytest
from support.straight_plans import elsewhere, everyone, straight

from mmp_env import PoseGoal, check_plan, load_plan, save_plan
from mmp_env.check import check_document
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.model.goals import as_goal, goal_to_data
from mmp_env.model.rings import ring_cell
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.scene import compile_scene

CELL = ring_cell(2, "panda", "fine")


def tool_poses(cell, q):
    """Returns arm name -> pose goal, from MuJoCo's frames of the tools."""
    model = compile_scene(cell)
    data = mujoco.MjData(model)
    for arm in cell.arms:
        for k, angle in enumerate(q[arm.name]):
            data.joint(f"{arm.name}/joint{k + 1}").qpos = angle
    mujoco.mj_kinematics(model, data)
    frames = {arm.name: data.body(f"{arm.name}/{arm.tool.name}") for arm in cell.arms}
    return {name: PoseGoal(frame.xpos, frame.xquat) for name, frame in frames.items()}


START, GOAL = everyone(CELL, "tucked"), elsewhere(CELL)
POSES = tool_poses(CELL, GOAL)


def document(**asked):
    plan = straight(CELL, START, GOAL)
    return plan_to_dict(dataclasses.replace(plan, problem=dataclasses.replace(plan.problem, goal_asked=POSES | asked)))


def rules(data):
    return {violation.rule for violation in check_document(data).violations}


def turned(pose, angle, axis):
    """Returns a pose turned by an angle [rad] about an axis of its own frame."""
    q = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * np.eye(3)[axis]])
    out = np.empty(4)
    mujoco.mju_mulQuat(out, pose.quaternion, q)
    return out


def test_a_plan_to_the_poses_that_were_asked_for_is_valid():
    assert check_document(document()).valid


def moved(pose, metres, angle, axis=0, free=None):
    return PoseGoal(pose.position + np.array([metres, 0, 0]), turned(pose, angle, axis), free)


ARM = CELL.arm_names[1]
POSE = POSES[ARM]


@pytest.mark.parametrize(
    ("goal", "valid"),
    [
        (moved(POSE, 0.9e-4, 0.0), True),
        (moved(POSE, 1.1e-4, 0.0), False),
        (moved(POSE, 0.0, 0.9e-4), True),
        (moved(POSE, 0.0, 1.1e-4), False),
        (moved(POSE, 0.0, np.pi), False),
        (moved(POSE, 0.0, 1.0, 2, "z"), True),
        (moved(POSE, 0.0, np.pi, 2, "z"), True),
        (moved(POSE, 0.0, 1.1e-4, 0, "z"), False),
        (moved(POSE, 0.0, np.pi, 0, "z"), False),
        (moved(POSE, 0.0, 2.0, 1, "rotation"), True),
        (moved(POSE, 1.1e-4, 0.0, 1, "rotation"), False),
        ({"pose": {"position": POSE.position, "free": "rotation"}}, True),
        ({"any": ["home", goal_to_data(POSE)]}, True),
        ({"any": ["home", "stay"]}, False),
        ("tucked", False),
        (GOAL[ARM], True),
        (GOAL[ARM] + 2e-6, False),
    ],
    ids=str,
)
def test_the_end_is_something_that_was_asked_for_within_tolerance(goal, valid):
    assert rules(document(**{ARM: as_goal(goal, "goal")})) == (set() if valid else {"goal"})


def test_the_message_says_how_far_the_tool_is_off():
    (violation,) = check_document(document(**{ARM: moved(POSE, 0.05, 0.0)})).violations
    assert violation.arms == (ARM,)
    assert "ends at nothing that was asked for; the nearest is 0.05 m and" in violation.message


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({}, "goal_asked has no"),
        ({"other": "home"}, "which this checker does not know"),
        ("hme", "known: stay, home, tucked"),
        ({"pose": {"position": [0, 0, 1]}}, "has no 'quaternion'"),
        ({"pose": {"position": [0, 0, 1], "quaternion": [0, 0, 0, 0]}}, "not all zero"),
        ({"pose": {"position": [0, 0, np.inf], "free": "rotation"}}, "must be numbers within"),
        ({"pose": {"position": [0, 0, 1], "free": "x"}}, "known: z, rotation"),
        ({"any": []}, "has 0 goals"),
        ({"any": ["home"], "pose": {}}, "it must be one of them"),
        ({"any": ["home"], "pose": None}, "it must be one of them"),
        ({"pose": None}, "pose is not a JSON object"),
        ([0.0], "has shape [1]"),
        (None, "does not hold numbers only"),
    ],
    ids=str,
)
def test_an_unreadable_request_is_a_violation(asked, words):
    data = document()
    data["problem"]["goal_asked"] = asked if asked == {} else data["problem"]["goal_asked"] | {ARM: asked}
    (violation,) = check_document(data).violations
    assert violation.rule in ("schema", "shape")
    assert words in violation.message


def test_goals_nested_without_end_are_refused():
    data = document()
    deep: object = "home"
    for _ in range(50):
        deep = {"any": [deep]}
    data["problem"]["goal_asked"][ARM] = deep
    assert rules(data) == {"schema"}


def test_a_plan_file_keeps_what_was_asked(tmp_path):
    plan = straight(CELL, START, GOAL)
    asked = POSES | {ARM: as_goal({"any": ["stay", goal_to_data(POSE)]}, "goal")}
    save_plan(
        dataclasses.replace(plan, problem=dataclasses.replace(plan.problem, goal_asked=asked)), tmp_path / "p.json"
    )
    read = load_plan(tmp_path / "p.json")
    assert {name: goal_to_data(goal) for name, goal in read.problem.goal_asked.items()} == {
        name: goal_to_data(goal) for name, goal in asked.items()
    }
    assert check_plan(read).valid
