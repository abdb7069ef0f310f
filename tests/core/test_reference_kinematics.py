"""The kinematics reference against the vendors' tables, against MuJoCo, and its two Jacobians against each other."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import kinematics, toys

from mmp_env.model.arm import place_arm
from mmp_env.model.robot_reading import load_robot
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.robot_folders import robot_names

# Denavit-Hartenberg rows (a, d, alpha, offset of theta) from the vendors' manuals.
STANDARD_DH = {
    "ur5e": [
        (0, 0.1625, np.pi / 2, 0),
        (-0.425, 0, 0, 0),
        (-0.3922, 0, 0, 0),
        (0, 0.1333, np.pi / 2, 0),
        (0, 0.0997, -np.pi / 2, 0),
        (0, 0.0996, 0, 0),
    ],
    "fr5": [
        (0, 0.152, np.pi / 2, 0),
        (-0.425, 0, 0, 0),
        (-0.39501, 0, 0, 0),
        (0, 0.1021, np.pi / 2, 0),
        (0, 0.102, -np.pi / 2, 0),
        (0, 0.1, 0, 0),
    ],
}
MODIFIED_DH = {
    "panda": [
        (0, 0.333, 0, 0),
        (0, 0, -np.pi / 2, 0),
        (0, 0.316, np.pi / 2, 0),
        (0.0825, 0, np.pi / 2, 0),
        (-0.0825, 0.384, -np.pi / 2, 0),
        (0, 0, np.pi / 2, 0),
        (0.088, 0, np.pi / 2, 0),
        (0, 0.107, 0, 0),
    ],
    "piper": [
        (0, 0.123, 0, 0),
        (0, 0, -np.pi / 2, np.deg2rad(-172.22)),
        (0.28503, 0, 0, np.deg2rad(-102.78)),
        (-0.02198, 0.25075, np.pi / 2, 0),
        (0, 0, -np.pi / 2, 0),
        (0, 0.091, np.pi / 2, 0),
    ],
}
HOME_FLANGE = {
    "ur5e": [0.5096, 0.0, 0.4879],
    "fr5": [0.5074, 0.0, 0.4770],
    "panda": [0.3069, 0.0, 0.5903],
    "piper": [0.2465, 0.0, 0.4960],
}


def screw(axis, angle, distance):
    direction = np.eye(3)["xyz".index(axis)]
    out = kinematics.rotation_about(direction, angle)
    out[:3, 3] = distance * direction
    return out


def flange_by_table(name, q):
    rows = STANDARD_DH.get(name) or MODIFIED_DH[name]
    angles = [*q, *np.zeros(len(rows) - len(q))]
    pose = np.eye(4)
    for (a, d, alpha, offset), theta in zip(rows, angles, strict=True):
        joint, link = screw("z", theta + offset, d), screw("x", alpha, a)
        pose = pose @ (joint @ link if name in STANDARD_DH else link @ joint)
    return pose


def arm_at_origin(name):
    return place_arm("arm", name, [0, 0, 0], [1, 0, 0, 0])


def configurations(name, count):
    return toys.random_configurations(np.random.default_rng(3), arm_at_origin(name), count)


@pytest.mark.parametrize("name", sorted(STANDARD_DH | MODIFIED_DH))
def test_the_flange_stands_where_the_vendor_s_table_puts_it(name):
    for q in configurations(name, 30):
        flange = kinematics.flange_frame(arm_at_origin(name), q)
        # The chain of the FR5 rounds its right angles to 1.5708.
        np.testing.assert_allclose(flange, flange_by_table(name, q), rtol=0, atol=1e-5)


@pytest.mark.parametrize("name", sorted(HOME_FLANGE))
def test_the_home_pose_puts_the_flange_in_front_of_the_base(name):
    flange = kinematics.flange_frame(arm_at_origin(name), load_robot(name).home)[:3, 3]
    np.testing.assert_allclose(flange, HOME_FLANGE[name], rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", robot_names())
def test_every_link_stands_where_mujoco_puts_the_body_of_the_mjcf(name):
    arm = arm_at_origin(name)
    model = mujoco.MjModel.from_xml_string(arm.robot.mjcf)
    data = mujoco.MjData(model)
    joints = [model.joint(f"joint{k + 1}").qposadr[0] for k in range(arm.dof)]
    for q in configurations(name, 20):
        data.qpos[joints] = q
        mujoco.mj_kinematics(model, data)
        for link, frame in zip(arm.robot.link_names, kinematics.link_frames(arm, q), strict=False):
            body = data.body(link)
            np.testing.assert_allclose(body.xpos, frame[:3, 3], rtol=0, atol=1e-6)
            np.testing.assert_allclose(body.xmat.reshape(3, 3), frame[:3, :3], rtol=0, atol=1e-6)
        flange = kinematics.flange_frame(arm, q)
        np.testing.assert_allclose(data.site("flange").xpos, flange[:3, 3], rtol=0, atol=1e-6)
        np.testing.assert_allclose(data.site("flange").xmat.reshape(3, 3), flange[:3, :3], rtol=0, atol=1e-6)


def test_the_tool_point_lies_beyond_the_flange_along_its_axis():
    arm = arm_at_origin("panda")
    for q in configurations("panda", 10):
        flange = kinematics.flange_frame(arm, q)
        np.testing.assert_allclose(kinematics.tool_point(arm, q), flange[:3, 3] + 0.1034 * flange[:3, 2], atol=1e-12)


def test_the_tool_turns_with_its_mount():
    arm = arm_at_origin("panda")
    tool, flange = kinematics.link_frames(arm, arm.robot.home)[-1], kinematics.flange_frame(arm, arm.robot.home)
    between = flange[:3, :3].T @ tool[:3, :3]
    np.testing.assert_allclose(between, kinematics.rotation_about([0, 0, 1], -np.pi / 4)[:3, :3], atol=1e-6)


def test_without_a_tool_the_tool_point_is_the_flange():
    arm = place_arm("arm", "panda", [0, 0, 0], [1, 0, 0, 0], tool=None)
    q = arm.robot.home
    np.testing.assert_array_equal(kinematics.tool_point(arm, q), kinematics.flange_frame(arm, q)[:3, 3])


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda wxyz: np.linalg.norm(wxyz) > 0.1))
def test_the_base_stands_as_its_quaternion_says(wxyz):
    arm = place_arm("arm", "ur5e", [0.3, -0.2, 0.1], wxyz)
    np.testing.assert_allclose(kinematics.base_frame(arm), arm.T_world_base, atol=1e-12)


def test_the_base_pose_moves_the_whole_arm():
    at_origin = arm_at_origin("ur5e")
    moved = place_arm("arm", "ur5e", [0.3, -0.2, 0.1], quaternion_from_yaw(0.7))
    q = configurations("ur5e", 1)[0]
    for before, after in zip(kinematics.link_frames(at_origin, q), kinematics.link_frames(moved, q), strict=True):
        np.testing.assert_allclose(moved.T_world_base @ before, after, atol=1e-12)


@given(
    name=st.sampled_from(robot_names()),
    fractions=st.lists(st.floats(0, 1), min_size=7, max_size=7),
    part=st.integers(0, 8),
    local=st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
)
def test_the_analytic_point_jacobian_agrees_with_finite_differences(name, fractions, part, local):
    arm = place_arm("arm", name, [0.2, 0.1, 0.3], [0.9, 0.1, -0.3, 0.2])
    part = min(part, len(kinematics.part_names(arm)) - 1)
    q = arm.robot.lower + np.array(fractions[: arm.dof]) * (arm.robot.upper - arm.robot.lower)
    analytic = kinematics.point_jacobian(arm, q, part, local)
    np.testing.assert_allclose(
        analytic, kinematics.point_jacobian_by_differences(arm, q, part, local), rtol=0, atol=1e-8
    )
