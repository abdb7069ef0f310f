"""All configurations of one arm for a tool pose: exact, within the limits, with turns, the nearest first."""

from dataclasses import replace

import numpy as np
import pytest
from reference.inverse_kinematics import branches_by_restarts, tool_frame
from reference.kinematics import flange_frame
from support.unchecked import unchecked

from mmp_env import MmpError, place_arm
from mmp_env.ik import branches
from mmp_env.ik.chain import chain_of
from mmp_env.ik.refinement import refined
from mmp_env.ik.tool_task import ToolTask

ROBOTS = ("fr5", "panda", "piper", "ur5e")


def arm_of(name):
    return place_arm("arm", name, [0, 0, 0], [1, 0, 0, 0])


def drawn(arm, seed):
    robot = arm.robot
    q = np.random.default_rng(seed).uniform(robot.draw_lower, robot.draw_upper)
    return q, tool_frame(arm, q)


def errors(pose, other):
    """Returns the distance [m] and the angle [rad] between two poses."""
    sine = np.linalg.norm(pose[:3, :3] - other[:3, :3]) / np.sqrt(8)
    return np.linalg.norm(pose[:3, 3] - other[:3, 3]), 2 * np.arcsin(min(sine, 1.0))


@pytest.mark.parametrize("name", ROBOTS)
def test_configurations_are_exact_distinct_and_within_the_limits(name):
    arm = arm_of(name)
    for seed in range(3):
        _, pose = drawn(arm, seed)
        found = branches(arm.robot, arm.tool, pose)
        assert len(found) > 0
        assert (found >= arm.robot.lower).all()
        assert (found <= arm.robot.upper).all()
        for q in found[:64]:
            distance, angle = errors(tool_frame(arm, q), pose)
            assert distance < 1e-6
            assert angle < 1e-6
        gaps = np.abs(found[:, None] - found[None]).max(axis=2) + np.eye(len(found))
        assert gaps.min() > 1e-5


@pytest.mark.parametrize("name", ["fr5", "piper", "ur5e"])
def test_the_configuration_of_a_pose_is_found_and_comes_first(name):
    arm = arm_of(name)
    for seed in range(3):
        q, pose = drawn(arm, seed)
        assert branches(arm.robot, arm.tool, pose, near=q)[0] == pytest.approx(q, abs=1e-6)


def test_turns_within_the_limits_are_configurations_too():
    arm = arm_of("ur5e")
    _, pose = drawn(arm, 0)
    found = branches(arm.robot, None, pose)
    turned = found[0] + 2 * np.pi * np.eye(6)[5] * (-1 if found[0, 5] > 0 else 1)
    assert np.abs(found - turned).max(axis=1).min() < 1e-6


def test_configurations_are_ordered_by_distance_and_the_nearest_remain():
    arm = arm_of("ur5e")
    q, pose = drawn(arm, 1)
    found = branches(arm.robot, None, pose, near=q)
    cost = np.abs(found - q).sum(axis=1)
    assert (np.diff(cost) > -1e-5).all()
    assert (branches(arm.robot, None, pose, near=q, limit=5) == found[:5]).all()


def test_results_are_the_same_again():
    arm = arm_of("panda")
    _, pose = drawn(arm, 2)
    assert (branches(arm.robot, arm.tool, pose) == branches(arm.robot, arm.tool, pose)).all()


@pytest.mark.parametrize(("name", "free"), [("fr5", "z"), ("piper", "rotation"), ("panda", "z")])
def test_a_free_rotation_gives_more_configurations_with_the_tool_at_its_place(name, free):
    arm = arm_of(name)
    _, pose = drawn(arm, 0)
    found = branches(arm.robot, arm.tool, pose, free=free)
    assert len(found) > len(branches(arm.robot, arm.tool, pose))
    for q in found[:20]:
        frame = tool_frame(arm, q)
        assert frame[:3, 3] == pytest.approx(pose[:3, 3], abs=1e-6)
        if free == "z":
            assert frame[:3, 2] == pytest.approx(pose[:3, 2], abs=1e-6)


def test_no_configuration_reaches_too_far():
    pose = np.eye(4)
    pose[:3, 3] = [5.0, 0.0, 0.0]
    assert branches(arm_of("ur5e").robot, None, pose).shape == (0, 6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pose": np.eye(3)}, "matrix of 4 x 4"),
        ({"pose": np.full((4, 4), np.nan)}, "finite"),
        ({"pose": np.diag([2.0, 1, 1, 1])}, "no rigid transform"),
        ({"pose": np.diag([-1.0, 1, 1, 1])}, "no rigid transform"),
        ({"free": "x"}, "'z' or 'rotation'"),
        ({"limit": 0}, "limit is 0; it must be a whole number, 1 or more"),
        ({"near": [0.0, 1.0]}, "6 finite numbers"),
    ],
)
def test_faults_are_one_sentence(change, message):
    with unchecked(), pytest.raises(MmpError, match=message):
        branches(arm_of("ur5e").robot, None, **({"pose": np.eye(4)} | change))


def test_a_redundant_arm_has_a_configuration_near_each_configuration_of_a_pose():
    arm = arm_of("panda")
    for seed in range(4):
        q, pose = drawn(arm, seed)
        found = branches(arm.robot, arm.tool, pose)
        assert np.linalg.norm(found - q, axis=1).min() < 0.1


@pytest.mark.parametrize("angle", [0.0, 3e-5, -2e-4, 3e-3])
def test_curves_of_self_motion_that_nearly_cross_are_all_found(angle):
    """With its second joint near 0, a Panda can also turn its first joint against its third one."""
    arm = arm_of("panda")
    task = ToolTask(chain=chain_of(arm.robot, arm.tool), free=None)
    for seed in range(6):
        q, _ = drawn(arm, seed)
        q[1] = angle
        pose = tool_frame(arm, q)
        turned = q + np.linspace(-2, 2, 41)[:, None] * [1, 0, -1, 0, 0, 0, 0]
        others, _ = refined(task, turned, np.broadcast_to(pose, (41, 4, 4)), steps=40)
        others = others[((others >= arm.robot.lower) & (others <= arm.robot.upper)).all(axis=1)]
        assert len(others) > 3
        found = branches(arm.robot, arm.tool, pose)
        assert np.abs(found - others[:, None]).max(axis=2).min(axis=1).max() < 0.1


@pytest.mark.parametrize(("name", "near"), [("fr5", 1e-6), ("panda", 0.1), ("piper", 1e-6), ("ur5e", 1e-6)])
def test_what_newtons_method_finds_from_random_configurations_is_found(name, near):
    arm, rng = arm_of(name), np.random.default_rng(5)
    for seed in range(2):
        q, pose = drawn(arm, seed)
        found = branches(arm.robot, arm.tool, pose)
        for other in [q, *branches_by_restarts(arm, pose, 12, rng)]:
            assert np.abs(found - other).max(axis=1).min() < near


class OnRail:
    """A robot on a rail along y of its base."""

    def __init__(self, robot, length):
        self.origins = np.concatenate([np.eye(4)[None], robot.origins])
        self.axes = np.concatenate([[[0.0, 1.0, 0.0]], robot.axes])
        self.slides = (True, *robot.slides)
        self.lower, self.upper, self.home = (
            np.array([first, *rest]) for first, rest in ((0, robot.lower), (length, robot.upper), (0, robot.home))
        )
        self.flange = robot.flange


def test_an_arm_on_a_rail_reaches_a_pose_from_all_along_the_rail():
    arm = arm_of("fr5")
    q, pose = drawn(arm, 0)
    pose[1, 3] += 0.3
    found = branches(OnRail(arm.robot, 0.6), None, pose)
    assert np.abs(found - [0.3, *q]).max(axis=1).min() < 0.1
    assert np.ptp(found[:, 0]) > 0.3
    for each in found[::10]:
        frame = flange_frame(arm, each[1:])
        frame[1, 3] += each[0]
        assert max(errors(frame, pose)) < 1e-6


def test_an_arm_without_a_closed_form_is_solved_numerically():
    arm = arm_of("fr5")
    arm = replace(arm, robot=replace(arm.robot, axes=np.random.default_rng(3).normal(size=(6, 3))))
    for seed in range(3):
        q, pose = drawn(arm, seed)
        assert np.abs(branches(arm.robot, None, pose) - q).max(axis=1).min() < 1e-6
