"""Held objects: covered by spheres, part of every query, of the scene and of the checker's own model."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import tiny_plans, two_arms

from mmp_env import check_plan
from mmp_env.check.held import held_spheres
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.reading import read_cell
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.held import MOST_SPHERES, covering_spheres
from mmp_env.model.plan_fit import check_fit
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.sim.simulation import Simulation

SHAPES = {
    "box": {"size": [0.04, 0.05, 0.08]},
    "plate": {"shape": "box", "size": [0.3, 0.3, 0.002]},
    "sphere": {"radius": 0.03},
    "capsule": {"radius": 0.02, "length": 0.11},
    "cylinder": {"radius": 0.03, "length": 0.1},
    "wire": {"shape": "cylinder", "radius": 0.001, "length": 0.4},
}


def held(kind, **changes):
    return {"shape": kind, "position": [0.01, 0.02, 0.12], "quaternion": [0.9, 0.1, 0.3, -0.2]} | SHAPES[kind] | changes


def cell_with(what, robot="ur5e", **more):
    arm = {"name": "a", "robot": robot, "position": [0, 0, 0]} | ({"held": what} if what else {})
    return cell_from_dict({"name": "c", "arms": [arm], "spheres": "28", **more}, "cell")


def inside(solid: Obstacle, share):
    """Returns a point of the solid, on its surface if `share` [3] has ones."""
    radius, half = solid.radius or 0.0, (solid.length or 0.0) / 2
    if solid.shape == "box":
        point = share * solid.size / 2
    else:
        around = np.array([np.cos(np.pi * share[0]), np.sin(np.pi * share[0]), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        if solid.shape == "cylinder":
            point = abs(share[1]) * radius * around + share[2] * half * up
        else:
            tilt = np.pi / 2 * share[1]
            point = share[2] * half * up + radius * (np.cos(tilt) * around + np.sin(tilt) * up)
    return matrix_from_quaternion(solid.quaternion) @ point + solid.position


@pytest.mark.parametrize("kind", SHAPES)
@given(share=st.lists(st.sampled_from([-1.0, 1.0]) | st.floats(-1, 1), min_size=3, max_size=3))
def test_every_point_of_a_held_object_is_in_one_of_its_spheres(kind, share):
    solid = cell_with(held(kind)).arms[0].held
    centers, radii = covering_spheres(solid)
    assert len(radii) <= MOST_SPHERES
    assert (np.linalg.norm(centers - inside(solid, np.array(share)), axis=1) <= radii + 1e-9).any()


@pytest.mark.parametrize("kind", SHAPES)
@given(share=st.lists(st.sampled_from([-1.0, 1.0]) | st.floats(-1, 1), min_size=3, max_size=3))
def test_every_point_of_a_solid_is_in_the_box_around_it(kind, share):
    solid = cell_with(held(kind)).arms[0].held
    local = (inside(solid, np.array(share)) - solid.position) @ matrix_from_quaternion(solid.quaternion)
    assert (np.abs(local) <= solid.half_extents + 1e-12).all()


@pytest.mark.parametrize(
    ("kind", "half"),
    [
        ("box", [0.02, 0.025, 0.04]),
        ("sphere", [0.03, 0.03, 0.03]),
        ("capsule", [0.02, 0.02, 0.075]),
        ("cylinder", [0.03, 0.03, 0.05]),
    ],
)
def test_the_box_around_a_solid_is_no_larger_than_it_must_be(kind, half):
    assert cell_with(held(kind)).arms[0].held.half_extents.tolist() == pytest.approx(half)


def test_the_spheres_of_the_usual_object_stand_out_by_7_mm():
    centers, radii = covering_spheres(
        cell_with(held("box", size=[0.04, 0.04, 0.08], yaw=0.0, quaternion=None)).arms[0].held
    )
    over = (np.abs(centers - [0.01, 0.02, 0.12]) + radii[:, None]).max(axis=0) - [0.02, 0.02, 0.04]
    assert over.max() == pytest.approx(0.0073, abs=1e-4)


@pytest.mark.parametrize("robot", ["ur5e", "panda", "fr5", "piper"])
@pytest.mark.parametrize("kind", SHAPES)
def test_planners_checker_and_mujoco_have_it_in_the_same_place(kind, robot):
    cell = cell_with(held(kind), robot)
    arm, q = cell.arms[0], cell.arms[0].robot.home
    is_held = np.array(cell.collision.sphere_links("a")) == "held"
    centers, radii = cell.collision.spheres("a", [q])
    model = CellModel(read_cell(cell_to_dict(cell)))
    cloud = sphere_parts(model)[1][-1]
    body = model.mujoco.body("a/held").id
    poses = model.poses(np.zeros(1), np.array([q]))
    seen = cloud.centers @ poses.rotations[0, body].T + poses.positions[0, body]
    gaps = np.linalg.norm(centers[0][is_held][:, None] - seen[None], axis=-1)
    assert gaps.min(axis=1).max() < 1e-7
    assert gaps.min(axis=0).max() < 1e-7
    assert np.sort(radii[is_held]) == pytest.approx(np.sort(cloud.radii), abs=1e-12)
    assert len(held_spheres(model.cell.arms[0].held)) == is_held.sum()
    simulation = Simulation(cell)
    simulation.place(np.array(q))
    geom = simulation.model.geom("a/held").id
    T = arm.T_world_base  # the base stands at the origin
    assert np.allclose(T, np.eye(4))
    middle = poses.rotations[0, body] @ arm.held.position + poses.positions[0, body]
    np.testing.assert_allclose(simulation.data.geom_xpos[geom], middle, atol=1e-7)


@pytest.mark.parametrize("kind", SHAPES)
def test_a_cell_with_a_held_object_reads_back_the_same(kind):
    written = cell_to_dict(cell_with(held(kind)))
    assert written["arms"][0]["held"]["name"] == "held"
    assert cell_to_dict(cell_from_dict(written, "again")) == written
    assert "held" not in cell_to_dict(cell_with(None))["arms"][0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"shape": "cone"}, "held.shape: unknown shape 'cone'"),
        ({"size": None}, "held.size is missing"),
        ({"radius": 0.1}, "held.radius is 0.1; a box has size only"),
        ({"weight": 1.0}, "held: unknown field 'weight'"),
        ({"position": [0, 0]}, "held.position"),
    ],
)
def test_a_bad_held_object_is_named_with_field_and_value(changes, words):
    with pytest.raises(MmpError) as error:
        cell_with({key: value for key, value in held("box", **changes).items() if value is not None})
    assert f"arms[0].{words}" in str(error.value)


def wall(x):
    return Obstacle(
        name="wall",
        shape="box",
        position=np.array([x, 0, 0.5]),
        quaternion=np.array([1.0, 0, 0, 0]),
        size=np.array([0.02, 1.0, 1.0]),
    )


def test_a_held_object_touches_obstacles_that_the_bare_arm_does_not():
    """The flange of an upright UR5e points along -y, so a rod in it reaches the other arm's side."""
    bare, full = cell_with(None), cell_with(held("capsule", position=[0, 0, 0.3], quaternion=[1, 0, 0, 0]))
    q = bare.arms[0].robot.home
    flange = bare.collision.tool_points("a", [q])[0]
    spheres = full.collision.spheres("a", [q])[0][0][np.array(full.collision.sphere_links("a")) == "held"]
    ahead = spheres.mean(axis=0) - flange
    assert np.linalg.norm(ahead) == pytest.approx(0.3, abs=1e-3)
    ball = Obstacle(
        name="ball", shape="sphere", position=flange + ahead, quaternion=np.array([1.0, 0, 0, 0]), radius=0.05
    )
    bare, full = (dataclasses.replace(cell, obstacles=(ball,)) for cell in (bare, full))
    assert bare.collision.is_free("a", [q]).all()
    assert not full.collision.is_free("a", [q]).any()
    simulation = Simulation(full)
    simulation.place(np.array(q))
    assert [(c.body_a, c.body_b) for c in simulation.log.contacts] == [("a/held", "obstacle/ball")]


@pytest.mark.parametrize("exact", [False, True])
def test_the_checker_refutes_a_plan_that_is_right_with_empty_tools_only(exact):
    rod = {"shape": "capsule", "position": [0, 0, 0.25], "radius": 0.02, "length": 0.3}
    arms = [tiny_plans.arm("left", [0, 0, 0]), tiny_plans.arm("right", [0, 1.0, 0])]
    document = tiny_plans.plan(arms, {name: [tiny_plans.REACHING] * 2 for name in ("left", "right")})
    assert check_plan(document, exact=exact).valid
    document["problem"]["cell"]["obstacles"] = [
        {"name": "post", "shape": "sphere", "position": held_at(document, rod), "radius": 0.03}
    ]
    assert check_plan(document, exact=exact).valid
    document["problem"]["cell"]["arms"][0]["held"] = rod
    (violation,) = check_plan(document, exact=exact).violations
    assert violation.rule == "arm-obstacle"
    assert violation.values["things"] == ["left/held", "obstacle/post"]


def held_at(document, what):
    """Returns the position of the middle of a held object in the world at the start."""
    data = tiny_plans.copy_of(document)
    data["problem"]["cell"]["arms"][0]["held"] = what
    plan = plan_from_dict(data)
    spheres, _ = plan.problem.cell.collision.spheres("left", [plan.problem.start["left"]])
    return spheres[0][np.array(plan.problem.cell.collision.sphere_links("left")) == "held"].mean(axis=0).tolist()


def test_a_held_object_may_touch_the_link_and_tool_that_hold_it():
    close = {"shape": "sphere", "position": [0, 0, 0.0], "radius": 0.03}
    far = {"shape": "sphere", "position": [0, 0, 0.0], "radius": 0.12}
    home = cell_with(None).arms[0].robot.home
    assert cell_with(close).collision.is_free("a", [home]).all()
    assert not cell_with(far).collision.is_free("a", [home]).any()


def test_contacts_of_a_held_object_with_other_links_of_its_arm_count():
    """MuJoCo finds these contacts too, also with the parent of the holding link, which it excludes by default."""
    simulation = Simulation(cell_with({"shape": "sphere", "position": [0, 0, 0.0], "radius": 0.12}))
    simulation.place(np.array(simulation.cell.arms[0].robot.home))
    assert {(c.body_a, c.body_b) for c in simulation.log.contacts} >= {("a/wrist1", "a/held"), ("a/wrist2", "a/held")}
    simulation = Simulation(cell_with({"shape": "sphere", "position": [0, 0, 0.0], "radius": 0.03}))
    simulation.place(np.array(simulation.cell.arms[0].robot.home))
    assert simulation.log.contacts == []


def test_a_plan_for_another_held_object_does_not_fit():
    document = tiny_plans.plan([tiny_plans.arm("left", [0, 0, 0])], {"left": [tiny_plans.UPRIGHT] * 2})
    document["problem"]["cell"]["arms"][0]["held"] = held("box")
    plan = plan_from_dict(document)
    check_fit(plan, plan.problem.cell)
    bare = Cell(name="bare", arms=(place_arm("left", "ur5e", [0, 0, 0], [1, 0, 0, 0]),))
    with pytest.raises(MmpError, match="the held object of arm 'left' is box there and none here"):
        check_fit(plan, bare)
    arm = dataclasses.replace(bare.arms[0], held=cell_with(held("box", size=[0.04, 0.05, 0.09])).arms[0].held)
    with pytest.raises(MmpError, match="the size of the held object of arm 'left'"):
        check_fit(plan, dataclasses.replace(bare, arms=(arm,)))


def test_gravity_does_not_pull_a_holding_arm_away():
    cell = cell_with(held("box"))
    simulation = Simulation(cell)
    q = np.array(cell.arms[0].robot.home)
    simulation.place(q)
    simulation.ramp(q, q, 250)
    assert np.abs(simulation.positions - q).max() < 1e-3


def test_obstacle_is_no_name_of_an_arm():
    """The held object of such an arm would have the name of an obstacle's geom."""
    cell = two_arms.facing_cell()
    with pytest.raises(MmpError, match="kept for obstacles"):
        dataclasses.replace(cell, arms=(dataclasses.replace(cell.arms[0], name="obstacle"), cell.arms[1]))
