"""Every robot and tool: its data are consistent, and its MJCF agrees with its `robot.json`."""

import json
import pickle

import hypothesis.strategies as st
import mujoco
import numpy as np
import pytest
from hypothesis import given
from reference.clearance import self_clearance
from reference.kinematics import link_frames

from mmp_env.errors import UnknownNameError
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import EXACT, SPHERE_SETS
from mmp_env.model.robot_reading import load_robot, load_tool
from mmp_env.robot_folders import find_robot, robot_names, tool_names

every_robot = pytest.mark.parametrize("name", robot_names())
every_tool = pytest.mark.parametrize("name", tool_names())
every_model = pytest.mark.parametrize(
    "model", [*map(load_robot, robot_names()), *map(load_tool, tool_names())], ids=lambda model: model.name
)


def one_arm(name, tool="default", spheres="28"):
    arm = place_arm("arm0", name, [0, 0, 0], [1, 0, 0, 0], tool=tool)
    return Cell(name="alone", arms=(arm,), spheres=spheres)


def compiled(model):
    return mujoco.MjModel.from_xml_string(model.mjcf)


def test_the_four_arms_and_the_hand_are_there():
    assert set(robot_names()) >= {"fr5", "panda", "piper", "ur5e"}
    assert tool_names() == ["franka-hand"]
    assert load_robot("panda").default_tool == "franka-hand"
    assert load_robot("panda").acceleration_published


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("ur5", "ur5e"),
        ("UR5e", "ur5e"),
        ("ur-5e", "ur5e"),
        ("Panda", "panda"),
        ("pandas", "panda"),
        ("pipper", "piper"),
    ],
)
def test_a_misspelled_robot_is_answered_with_the_one_that_was_meant(name, meant):
    with pytest.raises(UnknownNameError, match=f"Did you mean '{meant}'"):
        load_robot(name)


@pytest.mark.parametrize(
    "name", ["fr3", "ur3e", "ur10e", "ur15", "fr10", "iiwa14", "gen3", "xarm7", "kr5", "fanuc", "yumi", ""]
)
def test_another_arm_is_not_answered_with_one_that_is_spelled_alike(name):
    with pytest.raises(UnknownNameError) as error:
        load_robot(name)
    assert str(error.value) == (
        f"unknown robot '{name}'. Known: fr5, panda, piper, ur5e."
        " docs/how-to/add-a-robot.md explains how to add another"
    )
    assert str(pickle.loads(pickle.dumps(error.value))) == str(error.value)


def test_an_unknown_tool_is_not_answered_with_that_of_another_vendor():
    with pytest.raises(
        UnknownNameError, match=r"unknown tool 'schunk-hand'\. Known: franka-hand\. docs/how-to/add-a-tool\.md"
    ):
        load_tool("schunk-hand")


@every_robot
def test_all_arrays_of_a_robot_have_one_entry_a_joint(name):
    robot = load_robot(name)
    assert len(robot.link_names) == robot.dof + 1
    assert robot.origins.shape == (robot.dof, 4, 4)
    assert robot.axes.shape == (robot.dof, 3)
    for values in (robot.lower, robot.upper, robot.velocity, robot.acceleration, robot.jerk, robot.effort):
        assert values.shape == (robot.dof,)
    for values in (robot.velocity, robot.acceleration, robot.jerk, robot.effort, robot.upper - robot.lower):
        assert (values > 0).all()
    np.testing.assert_allclose(np.linalg.norm(robot.axes, axis=1), 1.0)


@every_robot
def test_acceleration_limits_are_the_stated_defaults_unless_published(name):
    robot = load_robot(name)
    if not robot.acceleration_published:
        assert set(robot.acceleration) == {8.0}
        assert set(robot.jerk) == {4000.0}


@every_robot
def test_both_sphere_sets_have_positive_radii_on_every_link(name):
    robot = load_robot(name)
    assert set(robot.spheres) - {EXACT} == set(robot.self_ignore) - {EXACT} == set(SPHERE_SETS)
    for spheres in robot.spheres.values():
        assert spheres.centers.shape == (len(spheres.radii), 3)
        assert (spheres.radii > 0).all()
        assert set(spheres.links) == set(range(robot.dof + 1))
    assert (robot.spheres["28"].links > 0).sum() == 28


@pytest.mark.parametrize("spheres", SPHERE_SETS)
@every_robot
def test_home_and_tucked_are_within_limits_and_free_of_self_collision(name, spheres):
    robot = load_robot(name)
    for q in (robot.home, robot.tucked):
        assert ((robot.lower < q) & (q < robot.upper)).all()
        assert self_clearance(one_arm(name, spheres=spheres), "arm0", q) > 0


@every_robot
def test_the_mjcf_has_the_agreed_names(name):
    robot, model = load_robot(name), compiled(load_robot(name))
    assert [model.body(i).name for i in range(1, model.nbody)] == list(robot.link_names)
    assert [model.joint(i).name for i in range(model.njnt)] == [f"joint{i + 1}" for i in range(robot.dof)]
    assert [model.actuator(i).name for i in range(model.nu)] == [f"servo{i + 1}" for i in range(robot.dof)]
    assert list(model.actuator_trnid[:, 0]) == list(range(robot.dof))
    assert model.body(model.site("flange").bodyid[0]).name == robot.link_names[-1]
    assert model.nkey == model.nmesh == model.ntex == 0


@every_robot
def test_the_mjcf_has_the_joint_limits_of_the_robot(name):
    robot, model = load_robot(name), compiled(load_robot(name))
    assert model.jnt_limited.all()
    np.testing.assert_allclose(model.jnt_range, np.c_[robot.lower, robot.upper], atol=1e-9)


@every_robot
@given(seed=st.integers(0, 2**32 - 1))
def test_the_mjcf_has_the_kinematics_of_the_robot(name, seed):
    cell = one_arm(name, tool=None)
    robot = cell.arms[0].robot
    q = np.random.default_rng(seed).uniform(robot.lower, robot.upper)
    model = compiled(robot)
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    frames = link_frames(cell.arms[0], q)
    for link, frame in zip(robot.link_names, frames, strict=True):
        assert_same_frame(data.body(link), frame)
    assert_same_frame(data.site("flange"), frames[-1] @ robot.flange)


def assert_same_frame(found, wanted):
    """Checks that two frames agree within 1e-6 m and 1e-6 rad."""
    assert np.linalg.norm(found.xpos - wanted[:3, 3]) < 1e-6
    turn = found.xmat.reshape(3, 3).T @ wanted[:3, :3]
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    assert np.linalg.norm(skew) < 1e-6
    assert np.trace(turn) > 2.9


@every_robot
def test_links_that_may_overlap_do_not_collide_in_the_mjcf(name):
    robot, model = load_robot(name), compiled(load_robot(name))
    excluded = {(sign >> 16, sign & 0xFFFF) for sign in map(int, model.exclude_signature)}
    found = {tuple(sorted((a - 1, b - 1))) for a, b in excluded}
    neighbours = {(i, i + 1) for i in range(robot.dof)}
    assert found == neighbours.union(*robot.self_ignore.values())


@every_robot
def test_an_arm_at_home_or_tucked_touches_nothing_of_itself_in_mujoco(name):
    robot, model = load_robot(name), compiled(load_robot(name))
    data = mujoco.MjData(model)
    for q in (robot.home, robot.tucked):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        assert data.ncon == 0


@pytest.mark.parametrize(
    ("name", "mass_kg"), [("ur5e", 21.7), ("panda", 16.69), ("fr5", 22.0), ("piper", 4.2), ("franka-hand", 0.73)]
)
def test_masses_are_those_of_the_real_arms(name, mass_kg):
    model = compiled(load_tool(name) if name in tool_names() else load_robot(name))
    assert model.body_mass.sum() == pytest.approx(mass_kg, abs=0.01)


@every_model
def test_gravity_is_compensated_for_every_body(model):
    assert (compiled(model).body_gravcomp[1:] == 1).all()


@every_tool
def test_the_tool_hangs_on_the_flange_as_its_mount_says(name):
    tool = load_tool(name)
    spec = mujoco.MjSpec.from_string(load_robot("panda").mjcf)
    spec.attach(mujoco.MjSpec.from_string(tool.mjcf), site=spec.site("flange"), prefix="held/")
    model = spec.compile()
    data = mujoco.MjData(model)
    cell = one_arm("panda", tool=name)
    data.qpos[:] = q = load_robot("panda").home
    mujoco.mj_kinematics(model, data)
    frame = link_frames(cell.arms[0], q)[-1]
    assert_same_frame(data.body(f"held/{name}"), frame)
    np.testing.assert_allclose(data.site("held/tool_point").xpos, frame[:3, :3] @ tool.point + frame[:3, 3], atol=1e-6)


@every_tool
def test_both_sphere_sets_of_a_tool_have_positive_radii(name):
    tool = load_tool(name)
    assert set(tool.spheres) - {EXACT} == set(tool.self_ignore) - {EXACT} == set(SPHERE_SETS)
    for key, spheres in tool.spheres.items():
        assert (spheres.radii > 0).all()
        assert tool.self_ignore[key] <= set(load_robot("panda").link_names)


@every_robot
def test_every_link_of_the_file_has_a_hull_volume(name):
    data = json.loads((find_robot(name) / "robot.json").read_text())
    assert list(data["hull_volumes_m3"]) == data["links"]
    assert min(data["hull_volumes_m3"].values()) > 0
