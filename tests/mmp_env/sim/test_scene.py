"""The MuJoCo model of a cell: names, order, contacts and appearance."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mmp_env.errors import MmpError
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.rings import ring_cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.robot_reading import load_robot
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.mujoco_import import mujoco
from mmp_env.robot_folders import robot_names
from mmp_env.sim.arm_colors import PALETTE
from mmp_env.sim.scene import TIMESTEP_S, compile_scene
from mmp_env.sim.scene_appearance import CAMERA
from mmp_env.sim.simulation import Simulation

UPRIGHT = [1.0, 0.0, 0.0, 0.0]


def mixed_cell(**options):
    """Returns a cell of a UR5e and a Panda with its hand, far apart, one of them turned and raised."""
    tilted = np.array([0.9, 0.1, -0.2, 0.3])
    arms = (place_arm("left", "ur5e", [-0.8, 0.1, 0.2], tilted), place_arm("right", "panda", [0.9, 0, 0], UPRIGHT))
    return Cell(name="mixed", arms=arms, **options)


def obstacle(name, shape, position, quaternion=UPRIGHT, **measures):
    return Obstacle(
        name=name, shape=shape, position=frozen_array(position), quaternion=frozen_array(quaternion), **measures
    )


def touching(simulation):
    simulation.begin_log()
    return {(contact.body_a, contact.body_b) for contact in simulation.log.contacts}


@pytest.mark.parametrize("robot", robot_names())
@pytest.mark.parametrize("count", [2, 8])
def test_every_ring_is_one_model_with_its_joints_and_servos_in_the_order_of_the_arms(robot, count):
    cell = ring_cell(count, robot)
    model = compile_scene(cell)
    numbers = [f"arm{k}/{{}}{j + 1}" for k in range(count) for j in range(cell.arms[0].dof)]
    assert [model.joint(k).name for k in range(model.njnt)] == [name.format("joint") for name in numbers]
    assert [model.actuator(k).name for k in range(model.nu)] == [name.format("servo") for name in numbers]
    assert model.opt.timestep == TIMESTEP_S
    assert model.nkey == 0
    assert model.geom("obstacle/table").bodyid[0] == 0


@pytest.mark.parametrize("pose", ["home", "tucked"])
@pytest.mark.parametrize("robot", robot_names())
def test_nothing_touches_in_a_ring_at_rest_though_the_bases_stand_on_the_table(robot, pose):
    simulation = Simulation(ring_cell(8, robot))
    simulation.place(simulation.joined({arm.name: getattr(arm.robot, pose) for arm in simulation.cell.arms}))
    assert simulation.data.ncon == 0


@given(st.integers(0, 2**32 - 1))
def test_tool_poses_agree_with_the_core(seed):
    cell = mixed_cell()
    simulation = SIMULATIONS.setdefault("mixed", Simulation(cell))
    rng = np.random.default_rng(seed)
    q = {arm.name: rng.uniform(arm.robot.lower, arm.robot.upper) for arm in cell.arms}
    simulation.place(simulation.joined(q))
    expected = [cell.collision.tool_points(name, q[name][None])[0] for name in cell.arm_names]
    np.testing.assert_allclose(simulation.tool_points, expected, atol=2e-6)


SIMULATIONS = {}


@pytest.mark.parametrize(
    ("shape", "measures", "reach"),
    [
        ("box", {"size": frozen_array([0.2, 0.4, 0.6])}, (0.1, 0.2, 0.3)),
        ("sphere", {"radius": 0.2}, (0.2, 0.2, 0.2)),
        ("cylinder", {"radius": 0.1, "length": 0.6}, (0.1, 0.1, 0.3)),
        ("capsule", {"radius": 0.1, "length": 0.6}, (0.1, 0.1, 0.4)),
    ],
)
def test_obstacles_have_the_sizes_that_the_cell_gives_them(shape, measures, reach):
    model = compile_scene(mixed_cell(obstacles=(obstacle("thing", shape, [0, 0, 2], **measures),)))
    spec = mujoco.MjSpec()
    probe = spec.worldbody.add_body(name="probe", mocap=True)
    probe.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0])
    geom = model.geom("obstacle/thing")
    spec.worldbody.add_geom(name="thing", type=int(geom.type[0]), size=geom.size, pos=geom.pos, quat=geom.quat)
    world = spec.compile()
    data = mujoco.MjData(world)
    for axis, extent in enumerate(reach):
        data.mocap_pos[0] = [0, 0, 2] + (extent + 0.05) * np.eye(3)[axis]
        mujoco.mj_forward(world, data)
        gap = mujoco.mj_geomDistance(world, data, world.body("probe").geomadr[0], world.geom("thing").id, 1.0, None)
        assert gap == pytest.approx(0.04, abs=1e-5)


def test_obstacles_stand_turned_as_the_cell_says():
    turned = quaternion_from_yaw(0.7)
    wall = obstacle("wall", "box", [1, 2, 3], turned, size=frozen_array([1, 2, 3]))
    geom = compile_scene(mixed_cell(obstacles=(wall,))).geom("obstacle/wall")
    np.testing.assert_allclose(geom.pos, [1, 2, 3])
    np.testing.assert_allclose(geom.quat, turned)


def test_an_arm_in_the_table_touches_it_and_the_floor_touches_nothing():
    simulation = Simulation(ring_cell(2))
    q = {arm.name: np.array(arm.robot.tucked) for arm in simulation.cell.arms}
    q["arm0"] = np.array([0.0, 0.6, 0.0, 0.0, 0.0, 0.0])  # stretched out, pointing into the table
    simulation.place(simulation.joined(q))
    bodies = touching(simulation)
    assert ("arm0/forearm", "obstacle/table") in bodies
    assert {body_b for _, body_b in bodies} == {"obstacle/table"}


def test_bases_in_the_table_and_in_each_other_do_not_touch():
    deep = frozen_array([2, 2, 1])
    block = obstacle("block", "box", [0, 0, -0.45], size=deep)
    arms = tuple(place_arm(name, "ur5e", [x, 0, 0], UPRIGHT) for name, x in (("a", 0.0), ("b", 0.05)))
    simulation = Simulation(Cell(name="crowd", arms=arms, obstacles=(block,)))
    simulation.place(simulation.joined({arm.name: arm.robot.tucked for arm in arms}))
    assert not {pair for pair in touching(simulation) if pair[0].endswith("/base") and pair[1].endswith("/base")}
    assert ("a/base", "obstacle/block") not in touching(simulation)


def test_two_arms_driven_into_each_other_touch():
    simulation = Simulation(ring_cell(2))
    level = np.array([0.0, -0.3, 0.0, 0.0, 0.0, 0.0])  # stretched out, away from the other arm
    simulation.place(np.tile(level + np.pi * np.eye(6)[0], 2))
    assert {tuple(body.partition("/")[0] for body in pair) for pair in touching(simulation)} == {("arm0", "arm1")}
    simulation.place(np.tile(level, 2))
    assert not touching(simulation)


def test_links_that_the_planners_do_not_test_against_each_other_do_not_collide_here():
    cell = ring_cell(2, "panda")
    model = compile_scene(cell)
    excluded = {frozenset((int(code) >> 16, int(code) & 0xFFFF)) for code in model.exclude_signature}
    for arm in cell.arms:
        bodies = [model.body(f"{arm.name}/{link}").id for link in arm.robot.link_names]
        for i, j in arm.robot.self_ignore["28"]:
            assert frozenset((bodies[i], bodies[j])) in excluded
        assert frozenset(bodies[:2]) in excluded
        hand = model.body(f"{arm.name}/franka-hand").id
        for link in arm.tool.self_ignore["28"]:
            assert frozenset((model.body(f"{arm.name}/{link}").id, hand)) in excluded


def test_keyframes_and_options_of_a_robots_mjcf_are_left_out():
    robot = load_robot("ur5e")
    text = robot.mjcf
    frames = '<option timestep="0.01"/><keyframe><key name="home" qpos="0 0 0 0 0 0"/></keyframe></mujoco>'
    mjcf = text.replace("</mujoco>", frames)
    arm = dataclasses.replace(place_arm("a", "ur5e", [0, 0, 0], UPRIGHT), robot=dataclasses.replace(robot, mjcf=mjcf))
    model = compile_scene(Cell(name="one", arms=(arm, dataclasses.replace(arm, name="b"))))
    assert model.nkey == 0
    assert model.opt.timestep == TIMESTEP_S


@pytest.mark.parametrize("text", ["<mujoco><worldbody><body/></worldbody>", "<mujoco/>"])
def test_mjcf_that_is_no_robot_is_an_error_that_says_so(text):
    robot = dataclasses.replace(load_robot("ur5e"), mjcf=text)
    arm = dataclasses.replace(place_arm("a", "ur5e", [0, 0, 0], UPRIGHT), robot=robot)
    with pytest.raises(MmpError, match=r"ur5e\.xml"):
        Simulation(Cell(name="one", arms=(arm,)))


def test_arms_have_different_colours():
    model = compile_scene(ring_cell(8))
    colours = [model.material(f"arm{k}/body").rgba[:3] for k in range(8)]
    np.testing.assert_allclose(colours, PALETTE, atol=1e-6)
    assert len(set(PALETTE)) == 8


@pytest.mark.parametrize("count", [2, 4, 8])
def test_the_camera_has_all_bases_and_tools_in_view(count):
    simulation = Simulation(ring_cell(count, "panda"))
    simulation.place(simulation.joined({arm.name: arm.robot.home for arm in simulation.cell.arms}))
    camera = simulation.data.camera(CAMERA)
    tangent = np.tan(np.radians(simulation.model.camera(CAMERA).fovy[0]) / 2)
    points = np.concatenate([simulation.tool_points, [arm.position for arm in simulation.cell.arms]])
    right, up, back = ((points - camera.xpos) @ camera.xmat.reshape(3, 3)).T
    assert (back < 0).all()
    assert (np.abs(right / back) < 4 / 3 * tangent).all()
    assert (np.abs(up / back) < tangent).all()


@pytest.mark.parametrize("robot", ["panda", "piper"])
def test_arms_of_a_cell_with_exact_geometry_collide_by_their_hulls(robot):
    model = compile_scene(ring_cell(2, robot, "exact"))
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    names = [model.geom(k).name for k in np.flatnonzero(collides)]
    robots = [name for name in names if name.startswith("arm")]
    assert len(robots) >= 2 * len(ring_cell(2, robot).arms[0].robot.hulls)
    assert all("/hull/" in name for name in robots)
