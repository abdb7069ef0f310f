"""Cells of whole models: arms, obstacles, allowed contacts, plans that are played in the model itself."""

import mujoco
import numpy as np
import pytest
from support.scenes import arm, fingers, scene
from support.unchecked import unchecked

import mmp_env
import mmp_planners
from mmp_env.errors import MmpError, MovedBodyWarning
from mmp_env.model.transforms import matrix_from_quaternion

CUBE = '<body name="cube" pos="0 0.6 0.03"><freejoint/><geom name="cube" type="box" size="0.03 0.03 0.03"/></body>'
POST = '<geom name="post" type="box" size="0.02 0.02 0.2" pos="0 0.2 0.2"/>'


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    """One cache for all tests of this file."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "scene-cache"))


def compiled(**parts):
    return mujoco.MjModel.from_xml_string(scene(**parts))


def cell_of(**parts):
    return mmp_env.cell_from_mujoco(compiled(**parts), {"left": "l_", "right": "r_"})


def test_equal_arms_share_one_robot_and_stand_where_the_model_has_them():
    cell = cell_of()
    left, right = cell.arms
    assert left.robot is right.robot
    assert left.robot.link_names == ("base", "link1", "link2", "link3")
    np.testing.assert_allclose(left.position, [-0.4, 0, 0.06])
    np.testing.assert_allclose(right.position, [0.4, 0, 0.06])


def test_all_that_no_arm_moves_is_an_obstacle():
    cell = cell_of(world=CUBE + POST)
    by_name = {obstacle.name: obstacle for obstacle in cell.obstacles}
    assert set(by_name) == {"floor", "cube", "post", "l_base geom 0", "r_base geom 0"}
    np.testing.assert_allclose(by_name["cube"].position, [0, 0.6, 0.03])
    floor = by_name["floor"]
    assert floor.position[2] + floor.half_size[2] == pytest.approx(0)


def test_the_flange_and_the_tips_are_where_mujoco_has_them():
    model = compiled()
    cell = mmp_env.cell_from_mujoco(model, {"left": "l_", "right": "r_"})
    data, q = mujoco.MjData(model), np.array([0.3, -0.8, 1.1])
    data.qpos[:] = np.tile(q, 2)
    mujoco.mj_forward(model, data)
    for name, prefix in (("left", "l_"), ("right", "r_")):
        np.testing.assert_allclose(
            cell.collision.tool_points(name, q[None])[0], data.body(f"{prefix}link3").xpos, atol=1e-6
        )


@pytest.mark.parametrize("exclude", [True, False])
def test_links_may_touch_what_the_model_excludes_or_what_they_always_touch(exclude):
    by_name = {obstacle.name: obstacle for obstacle in cell_of(world=POST, exclude=exclude).obstacles}
    assert by_name["l_base geom 0"].may_touch == {"left/link1"}
    assert by_name["floor"].may_touch == by_name["post"].may_touch == frozenset()


def test_geoms_that_cannot_collide_are_left_out():
    look = '<geom name="look" type="box" size="0.1 0.1 0.1" contype="0" conaffinity="0"/>'
    other = '<geom name="other" type="box" size="0.1 0.1 0.1" contype="2" conaffinity="2"/>'
    paired = '<contact><pair geom1="other" geom2="floor"/></contact>'
    names = {obstacle.name for obstacle in cell_of(world=look + other, after=paired).obstacles}
    assert names == {"floor", "l_base geom 0", "r_base geom 0"}


def test_fingers_are_held_and_belong_to_the_last_link():
    cell = cell_of(arms=arm("l_", -0.4, hand=fingers("l_")) + arm("r_", 0.4))
    left, right = cell.arms
    assert left.dof == right.dof == 3
    assert len(left.robot.hulls) == len(right.robot.hulls) + 2


def test_a_torso_stands_at_its_value_and_its_arms_may_touch_it():
    box = '<geom name="chest" type="box" size="0.42 0.1 0.05"/>'
    bodies = f"{box}{arm('l_', -0.4)}{arm('r_', 0.4)}"
    torso = f'<body name="torso" pos="0 0 0.3"><joint name="waist" range="-2 2"/>{bodies}</body>'
    model = compiled(arms=torso)
    cell = mmp_env.cell_from_mujoco(model, qpos=[np.pi / 2, 0, 0, 0, 0, 0, 0])
    assert cell.arm_names == ("l", "r")
    np.testing.assert_allclose(cell.arm("r").position, [0, 0.4, 0.36], atol=1e-9)
    chest = next(obstacle for obstacle in cell.obstacles if obstacle.name == "chest")
    assert chest.may_touch == {"l/link1", "r/link1"}


def test_meshes_and_ellipsoids_become_polytopes_around_them():
    rock = '<geom name="rock" type="mesh" mesh="rock" pos="0 0.6 0.4"/>'
    egg = '<geom name="egg" type="ellipsoid" size="0.05 0.08 0.1" pos="0 0.3 0.5"/>'
    mesh = '<mesh name="rock" vertex="0 0 0  0.1 0 0  0 0.1 0  0 0 0.1"/>'
    by_name = {obstacle.name: obstacle for obstacle in cell_of(world=rock + egg, asset=mesh).obstacles}
    stone = by_name["rock"]
    points = stone.pieces[0] @ matrix_from_quaternion(stone.quaternion).T + stone.position
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[0, 0.6, 0.4], [0.1, 0.7, 0.5]], atol=1e-4)
    (points,) = by_name["egg"].pieces
    assert (np.ptp(points, axis=0) >= [0.1, 0.16, 0.2]).all()
    np.testing.assert_allclose(np.ptp(points, axis=0), [0.1, 0.16, 0.2], atol=0.01)


def test_the_outline_of_a_large_mesh_can_be_read_from_a_plan(tmp_path):
    points = np.random.default_rng(0).normal(size=(2600, 3))
    points *= 0.25 / np.linalg.norm(points, axis=1, keepdims=True)
    mesh = f'<mesh name="ball" vertex="{" ".join(f"{x:.6f}" for x in points.ravel())}"/>'
    cell = cell_of(world='<geom name="ball" type="mesh" mesh="ball" pos="0 1 0.5"/>', asset=mesh)
    (outline,) = next(obstacle for obstacle in cell.obstacles if obstacle.name == "ball").pieces
    assert np.linalg.norm(outline, axis=1).max() < 0.256
    home = {"left": [0.0, 0.5, 0.5], "right": [0.0, 0.5, 0.5]}
    problem = mmp_env.make_problem(cell, home, home | {"left": [0.1, 0.5, 0.5]})
    plan = mmp_planners.make("auto").plan(problem, seed=0, time_limit=20).plan
    mmp_env.save_plan(plan, tmp_path / "plan.json")
    assert mmp_env.check_plan(mmp_env.load_plan(tmp_path / "plan.json")).valid


def test_the_geoms_of_an_arm_that_is_alone_in_its_model_are_its_collision_geometry():
    bodies = '<geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.1"/>'
    chain = f'<body><joint name="a"/>{bodies}<body pos="0.1 0 0.2"><joint name="b" axis="1 0 0"/>{bodies}</body></body>'
    cell = mmp_env.cell_from_mujoco(mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{chain}</worldbody></mujoco>"))
    assert len(cell.arms[0].robot.hulls) == 2
    assert not cell.obstacles


def test_the_name_of_a_cell_is_text():
    with (
        unchecked(),
        pytest.raises(MmpError, match="name is 3; the name of a cell must be 1 to 100 printable characters"),
    ):
        mmp_env.cell_from_mujoco(compiled(), {"left": "l_"}, name=3)


def test_names_with_slashes_and_nameless_geoms_are_taken():
    text = scene(arms=arm("robot0/", -0.4) + arm("robot1/", 0.4), actuator="")
    cell = mmp_env.cell_from_mujoco(mujoco.MjModel.from_xml_string(text))
    assert cell.arm_names == ("robot0", "robot1")
    assert {"robot0_base geom 0", "robot1_base geom 0"} <= {obstacle.name for obstacle in cell.obstacles}


def test_a_height_field_is_refused_by_name():
    field = '<geom name="hills" type="hfield" hfield="h"/>'
    with pytest.raises(MmpError, match="geom 'hills' is a height field, which a cell cannot represent"):
        cell_of(world=field, asset='<hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/>')


def test_a_whole_configuration_is_a_start_and_a_moved_body_is_told():
    model = compiled(world=CUBE)
    cell = mmp_env.cell_from_mujoco(model, {"left": "l_", "right": "r_"})
    data = mujoco.MjData(model)
    data.qpos[7:] = [0, 0.5, 0.5, 0, 0.4, 0.4]
    problem = mmp_env.make_problem(cell, data.qpos, {"left": [1.0, 0.5, 0.5], "right": [0.0, 0.5, 0.5]})
    assert problem.start["right"].tolist() == [0, 0.4, 0.4]
    data.qpos[0] += 0.1
    with pytest.warns(MovedBodyWarning, match=r"start: qpos\[0\] is 0.1, and cell 'two arms' was made with 0"):
        mmp_env.make_problem(cell, data.qpos, problem.goal)
    with pytest.raises(MmpError, match="start has 3 numbers; the qpos of the model of cell 'two arms' has 13"):
        mmp_env.make_problem(cell, [0, 0, 0], problem.goal)


def solved(model):
    cell = mmp_env.cell_from_mujoco(model, {"left": "l_", "right": "r_"})
    data = mujoco.MjData(model)
    data.qpos[:] = cell.joints.with_arms({"left": [-0.6, 1.3, 0.3], "right": [2.5, 1.3, 0.0]})
    goal = {"left": [0.6, 1.3, 0.0], "right": [-2.5, 1.3, 0.3]}
    problem = mmp_env.make_problem(cell, start=data.qpos, goal=goal)
    plan = mmp_planners.make("auto").plan(problem, seed=0, time_limit=20).plan
    assert plan is not None
    return plan, data


@pytest.mark.parametrize("actuator", ['<position joint="{name}" kp="400" kv="40"/>', '<motor joint="{name}"/>', ""])
def test_a_plan_is_played_in_the_model_itself(tmp_path, actuator):
    model = compiled(world=CUBE + POST, actuator=actuator)
    plan, data = solved(model)
    assert mmp_env.check_plan(plan).valid
    report = mmp_env.play(plan, model, data)
    assert report.reached
    assert not report.contacts
    assert not report.moved_to_start
    assert report.max_tracking_error_rad < (0.02 if "position" in actuator else 1e-6)
    mmp_env.save_plan(plan, tmp_path / "plan.json")
    again = mmp_env.play(mmp_env.load_plan(tmp_path / "plan.json"), model, mujoco.MjData(model))
    assert again.reached
    assert again.moved_to_start


def test_play_refuses_another_model():
    plan, _ = solved(compiled())
    other = mujoco.MjModel.from_xml_string(scene(arms=arm("l_", -0.4) + arm("q_", 0.4)))
    with pytest.raises(MmpError, match="the plan is for another model: joint 'r_joint1' of arm 'right' is at qpos"):
        mmp_env.play(plan, other, mujoco.MjData(other))


def test_play_refuses_two_position_actuators_on_a_joint():
    model = compiled(actuator=2 * '<position joint="{name}" kp="400" kv="40"/>')
    plan, data = solved(model)
    with pytest.raises(
        MmpError, match="the position actuators 'actuator 0' and 'actuator 1' both drive joint 'l_joint1'"
    ):
        mmp_env.play(plan, model, data)


def test_play_tells_of_a_body_that_has_moved():
    model = compiled(world=CUBE)
    plan, data = solved(model)
    data.qpos[0] += 0.1
    with pytest.warns(MovedBodyWarning, match=r"data.qpos\[0\] is 0.1, and cell 'two arms' was made with 0"):
        mmp_env.play(plan, model, data)


def test_play_tells_of_contacts_in_the_model():
    model = compiled()
    plan, _ = solved(model)
    box = '<geom name="late" type="box" size="0.05 0.3 0.05" pos="0.05 0 0.35"/>'
    report = mmp_env.play(plan, compiled(world=box), mujoco.MjData(compiled(world=box)))
    assert any(contact.body_b == "obstacle/late" for contact in report.contacts)


def test_a_model_file_is_no_plan(tmp_path):
    file = tmp_path / "two_arms.xml"
    file.write_text(scene())
    with pytest.raises(MmpError, match=r"two_arms.xml is a MuJoCo model, which mmp plan takes; load_plan takes a plan"):
        mmp_env.load_plan(file)
