"""Straight lines of tools: on the line at every instant, proved, and refused with the reason."""

import numpy as np
import pytest
from reference import kinematics, toys

from mmp_env import PoseGoal, check_plan, make_problem, ring_cell, straight_line
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.ik.chain import chain_of
from mmp_env.ik.tool_line import ToolLine, follow
from mmp_env.ik.turns import JointBox
from mmp_env.retime import retime

TOLERANCE = 1e-4


def cell_and_start(robot="panda"):
    cell = ring_cell(2, robot)
    goal = PoseGoal([0.0, 0.15, 0.35], [0, 1, 0, 0])
    problem = make_problem(cell, dict.fromkeys(cell.arm_names, "tucked"), {"arm0": goal, "arm1": "stay"})
    return cell, problem.goal


def tool_poses(cell, plan, name, step_s=0.002):
    """Returns the poses of a tool in the world at samples of a plan, by the reference kinematics."""
    times = np.append(np.arange(0.0, plan.makespan_s, step_s), plan.makespan_s)
    return np.array([kinematics.tool_frame(cell.arm(name), q) for q in plan.sampled(times)[name]])


def off_line(poses):
    """Returns the largest distance of the origins from the line through the first and the last [m]."""
    points = poses[:, :3, 3] - poses[0, :3, 3]
    along = points[-1] / np.linalg.norm(points[-1])
    return np.linalg.norm(points - np.outer(points @ along, along), axis=1).max()


def angles(rotations, wanted):
    """Returns the angles between rotation matrices [rad]."""
    return 2 * np.arcsin(np.minimum(np.linalg.norm(rotations - wanted, axis=(1, 2)) / np.sqrt(8), 1))


@pytest.mark.parametrize("robot", ["ur5e", "fr5", "panda"])
def test_the_tool_stays_on_its_line_and_does_not_turn(robot):
    cell, start = cell_and_start(robot)
    plan = straight_line(cell, start, by={"arm0": [0.0, 0.0, -0.1]})
    poses = tool_poses(cell, plan, "arm0")
    np.testing.assert_allclose(poses[-1, :3, 3] - poses[0, :3, 3], [0, 0, -0.1], atol=1e-8)
    assert off_line(poses) < TOLERANCE
    assert angles(poses[:, :3, :3], poses[0, :3, :3]).max() < TOLERANCE
    assert (plan.positions["arm1"] == start["arm1"]).all()
    assert check_plan(plan).valid


def test_a_displacement_in_the_tool_frame_follows_the_tool():
    cell, start = cell_and_start()
    plan = straight_line(cell, start, by={"arm0": [0.0, 0.0, 0.05]}, frame="tool")
    poses = tool_poses(cell, plan, "arm0")
    np.testing.assert_allclose(poses[-1, :3, 3] - poses[0, :3, 3], 0.05 * poses[0, :3, 2], atol=1e-8)


def test_a_finer_tolerance_is_kept():
    cell, start = cell_and_start()
    coarse, fine = (straight_line(cell, start, by={"arm0": [0, 0, -0.1]}, tolerance=t) for t in (1e-3, 1e-7))
    assert off_line(tool_poses(cell, fine, "arm0")) < 1e-7 < off_line(tool_poses(cell, coarse, "arm0")) < 1e-3
    assert len(fine.times) > 10 * len(coarse.times)


def test_the_line_ends_at_a_pose_that_the_checker_proves():
    cell, start = cell_and_start("ur5e")
    goal = PoseGoal([0.05, 0.15, 0.3], [0, 1, 0.1, 0])
    plan = straight_line(cell, start, to={"arm0": goal})
    poses = tool_poses(cell, plan, "arm0")
    np.testing.assert_allclose(poses[-1, :3, 3], goal.position, atol=1e-8)
    assert off_line(poses) < TOLERANCE
    # The rotation is even: its angle grows with the way.
    way = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1)
    turned = angles(poses[:, :3, :3], poses[0, :3, :3])
    assert turned[-1] > 0.1
    np.testing.assert_allclose(turned / turned[-1], way / way[-1], atol=0.01)
    assert plan.problem.goal_asked["arm0"] is goal
    assert check_plan(plan).valid


def test_a_tool_whose_rotation_is_free_turns_no_more_than_it_must():
    cell, start = cell_and_start()
    before = kinematics.tool_frame(cell.arm("arm0"), start["arm0"])
    target = [0.05, 0.15, 0.3]
    for free, quaternion in (("rotation", None), ("z", [0, 1, 0, 0])):
        plan = straight_line(cell, start, to={"arm0": PoseGoal(target, quaternion, free)})
        after = tool_poses(cell, plan, "arm0")[-1]
        np.testing.assert_allclose(after[:3, 3], target, atol=1e-8)
        np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-6)  # it points down already
        assert check_plan(plan).valid


def test_several_tools_move_on_one_clock():
    cell, start = cell_and_start()
    plan = straight_line(cell, start, by={"arm0": [0, 0, -0.1], "arm1": [0, 0, 0.05]})
    first, second = (tool_poses(cell, plan, name)[:, 2, 3] for name in cell.arm_names)
    np.testing.assert_allclose((first - first[0]) / -0.1, (second - second[0]) / 0.05, atol=0.02)


@pytest.mark.parametrize("slides", ["SHHHHHH", "HHHSHHH"])
def test_an_arm_with_a_slide_stays_on_its_line(slides):
    rng = np.random.default_rng(0)
    arm = toys.sliding_arm("arm", rng, [kind == "S" for kind in slides])
    chain, q = chain_of(arm.robot, arm.tool), (arm.robot.lower + arm.robot.upper) / 2
    box = JointBox(lower=arm.robot.lower, upper=arm.robot.upper, hinges=~np.array(arm.robot.slides))
    pose = kinematics.tool_frame(arm, q)
    begin = np.linalg.inv(arm.T_world_base) @ pose
    end = begin + 0.05 * np.outer([1, 0, 0, 0], [0, 0, 0, 1])
    found = follow(chain, box, q, ToolLine(begin=begin, end=end), TOLERANCE)
    assert found.whole
    assert np.ptp(found.q[:, slides.index("S")]) > 1e-4
    between = found.q[:-1] + rng.random((len(found.q) - 1, 1)) * np.diff(found.q, axis=0)
    assert off_line(np.array([kinematics.tool_frame(arm, row) for row in [q, *between, found.q[-1]]])) < TOLERANCE


def test_a_line_can_be_retimed():
    cell, start = cell_and_start()
    motion = retime(straight_line(cell, start, by={"arm0": [0, 0, -0.1]}), tolerance=1e-4)
    assert off_line(tool_poses(cell, motion, "arm0")) < 3e-4
    assert check_plan(motion).valid


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"by": {"arm0": [0, 0, 1.5]}}, "can follow .* singular configuration"),
        ({"by": {"arm0": [0, 0, -0.6]}}, "the straight line is not free: .*arm0/.* and .* apart|in collision"),
        ({"by": {"arm0": [0.0, 0.0]}}, "displacement of arm 'arm0'"),
        ({"by": {"arm0": [0, 0, np.nan]}}, "displacement of arm 'arm0'"),
        ({"by": {"arm9": [0, 0, 1]}}, "unknown arm 'arm9'"),
        ({}, "no tool moves"),
        ({"to": {"arm0": "home"}}, "must be a pose"),
        ({"to": {"arm0": PoseGoal([0, 0, 1], free="rotation")}, "by": {"arm0": [0, 0, 1]}}, "two straight lines"),
        ({"to": {"arm0": PoseGoal([0.0, 0.15, 0.35], [1, 0, 0, 0])}}, "half a turn"),
        ({"by": {"arm0": [0, 0, 0.1]}, "frame": "base"}, "unknown frame 'base'"),
        ({"by": {"arm0": [0, 0, 0.1]}, "tolerance": 0.0}, "tolerance is 0.0"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(options, message):
    cell, start = cell_and_start()
    with pytest.raises(MmpError, match=message):
        straight_line(cell, start, **options)


def test_a_joint_limit_on_the_line_is_named():
    cell = ring_cell(2, "piper")
    goal = {"arm0": PoseGoal([0.0, 0.1, 0.2], [0, 1, 0, 0], "z"), "arm1": "stay"}
    start = make_problem(cell, dict.fromkeys(cell.arm_names, "tucked"), goal).goal
    with pytest.raises(InvalidInstanceError, match=r"mm\); there joint 5 \(joint5\) reaches its limit: -1.2200 to"):
        straight_line(cell, start, by={"arm0": [0, 0, 0.2]})


def test_a_line_that_tilts_a_tool_beyond_its_bound_is_refused_with_the_angle():
    cell, start = cell_and_start("ur5e")
    axis = [0.0, 0.0, -1.0]
    down_again = PoseGoal([0.05, 0.15, 0.3], [0, 1, 0.1, 0])  # turned about z alone
    keep = {"arm0": {"upright": {"axis": axis, "within": 0.1}}}
    assert check_plan(straight_line(cell, start, to={"arm0": down_again}, keep=keep)).valid
    tilted = PoseGoal([0.05, 0.15, 0.3], [0.1, 1, 0, 0])
    with pytest.raises(InvalidInstanceError, match="rad from the world's z axis"):
        straight_line(cell, start, to={"arm0": tilted}, keep=keep)
