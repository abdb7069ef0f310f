"""The position servos of the MJCF: they hold an arm against gravity and follow a ramp with velocity feed-forward."""

import mujoco
import numpy as np
import pytest

from mmp_env.model.arm import place_arm
from mmp_env.model.robot_reading import load_robot
from mmp_env.robot_folders import robot_names

SPEED = 0.8
"""Largest velocity of the plans [rad/s]."""
STEP_S = 0.002

every_robot = pytest.mark.parametrize("name", robot_names())


class Servos:
    """One arm with its default tool, alone in the air, contacts off, at the physics step of the environment."""

    def __init__(self, name, start):
        self.robot = load_robot(name)
        spec = mujoco.MjSpec.from_string(self.robot.mjcf)
        arm = place_arm("arm0", name, [0, 0, 0], [1, 0, 0, 0])
        if arm.tool is not None:
            spec.attach(mujoco.MjSpec.from_string(arm.tool.mjcf), site=spec.site("flange"), prefix="tool/")
        spec.option.timestep = STEP_S
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.model = spec.compile()
        self.lead = -self.model.actuator_biasprm[:, 2] / self.model.actuator_gainprm[:, 0]
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = start
        self.errors, self.torques = [], []

    def follow(self, q, velocity):
        """Takes one physics step. `q` is the reference after the step."""
        self.data.ctrl[:] = q - velocity * STEP_S + self.lead * velocity
        mujoco.mj_step(self.model, self.data)
        self.errors.append(np.abs(self.data.qpos - q).max())
        self.torques.append(np.abs(self.data.qfrc_actuator) / self.robot.effort)


def ramp_toward_the_middle(robot, start):
    """Returns velocities of +-0.8 rad/s of all joints, away from the nearer limit."""
    return np.where(np.asarray(start) < (robot.lower + robot.upper) / 2, SPEED, -SPEED)


def starts(name, n=4):
    robot = load_robot(name)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    return [robot.home, robot.tucked, *np.random.default_rng(0).uniform(low, high, (n, robot.dof))]


@every_robot
def test_all_joints_follow_a_ramp_from_rest_and_back_to_rest_within_5_mrad(name):
    for start in starts(name):
        servos = Servos(name, start)
        velocity = ramp_toward_the_middle(servos.robot, start)
        for k in range(1, 251):
            servos.follow(start + velocity * k * STEP_S, velocity)
        for _ in range(100):
            servos.follow(start + velocity * 250 * STEP_S, np.zeros_like(velocity))
        assert max(servos.errors) < 0.005
        assert servos.errors[249] < 0.0005
        assert servos.errors[-1] < 0.0005


@every_robot
def test_a_ramp_that_reverses_instantly_is_followed_within_5_mrad(name):
    servos = Servos(name, load_robot(name).home)
    start = q = servos.robot.home
    velocity = ramp_toward_the_middle(servos.robot, start)
    for sign in (1, -1, 1):
        for _ in range(75):
            q = q + sign * velocity * STEP_S
            servos.follow(q, sign * velocity)
    assert max(servos.errors) < 0.005


@every_robot
def test_the_rated_efforts_carry_a_motion_within_the_acceleration_limits(name):
    robot = load_robot(name)
    servos = Servos(name, robot.home)
    rise_s = 2 * SPEED / robot.acceleration.min()
    top = ramp_toward_the_middle(robot, robot.home)
    q = robot.home.copy()
    for k in range(int(2 * rise_s / STEP_S)):
        velocity = top * np.sin(np.pi / 2 * min(k * STEP_S / rise_s, 1)) ** 2
        q = q + velocity * STEP_S
        servos.follow(q, velocity)
    assert np.max(servos.torques) < 1


@every_robot
def test_a_pose_is_held_against_gravity(name):
    robot = load_robot(name)
    servos = Servos(name, robot.home)
    for _ in range(250):
        servos.follow(robot.home, np.zeros(robot.dof))
    assert max(servos.errors) < 1e-6
    assert np.max(servos.torques) < 1
    assert np.max(servos.torques) > 0.01


@every_robot
def test_an_arm_that_is_driven_into_a_block_is_held_up_by_it(name):
    robot = load_robot(name)
    direction = np.zeros(robot.dof)
    direction[1] = np.sign((robot.lower + robot.upper) / 2 - robot.home)[1] or 1.0
    spec = mujoco.MjSpec.from_string(robot.mjcf)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.05, 0.05, 0.05], pos=flange_at(robot, robot.home + 0.5 * direction)
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = robot.home
    depths = []
    for k in range(1000):
        data.ctrl[:] = robot.home + direction * min(SPEED * k * STEP_S, 0.6)
        mujoco.mj_step(model, data)
        depths.append(-data.contact.dist.min(initial=0.0))
    assert depths[0] == 0
    assert 0 < max(depths) < 0.05
    assert np.abs(data.qpos - data.ctrl).max() > 0.05
    assert (data.warning.number == 0).all()
    assert np.abs(data.qvel).max() < 0.05


def flange_at(robot, q):
    """Returns position of the flange [m]."""
    model = mujoco.MjModel.from_xml_string(robot.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    return data.site("flange").xpos
