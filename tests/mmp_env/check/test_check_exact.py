"""The checker's two geometries against MuJoCo: the checker refutes every contact in MuJoCo."""

import functools

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference.kinematics import link_frames
from support import tiny_plans
from support.tiny_plans import REACHING

from mmp_env import check_plan
from mmp_env.check.geoms import GeomPairs, colliding_pairs, geom_parts
from mmp_env.check.items import Items
from mmp_env.check.model import CellModel
from mmp_env.check.reading import read_cell
from mmp_env.check.trajectory import PlacedTrajectory, Trajectory
from mmp_env.files.cell_file import cell_from_dict
from mmp_env.sim.scene import compile_scene

OUT_M = 0.002
"""Largest protrusion [m] of two MJCF geoms from their spheres: 1 mm each."""


def two(robot, distance):
    """Returns a cell of two equal arms that face each other."""
    arms = [
        tiny_plans.arm("left", [0.0, 0.0, 0.0], robot=robot),
        tiny_plans.arm("right", [distance, 0.0, 0.0], robot=robot, yaw=np.pi),
    ]
    if robot == "panda":
        for arm in arms:
            arm["tool"] = "franka-hand"
    return arms


@functools.cache
def scene(robot, distance):
    model = compile_scene(cell_from_dict({"arms": two(robot, distance), "spheres": "28"}, "cell"))
    return model, mujoco.MjData(model)


def touching(robot, distance, q):
    """Returns the deepest penetration [m] between the arms in MuJoCo, or None without contact."""
    model, data = scene(robot, distance)
    for name, joints in q.items():
        for k, angle in enumerate(joints):
            data.joint(f"{name}/joint{k + 1}").qpos[0] = angle
    mujoco.mj_forward(model, data)
    depths = []
    for contact in data.contact:
        bodies = {model.body(model.geom_bodyid[geom]).name.partition("/")[0] for geom in contact.geom}
        if bodies == {"left", "right"} and contact.dist < 0:
            depths.append(-contact.dist)
    return max(depths, default=None)


TOWARDS = {"ur5e": [3.1416, -0.6, 0.3, -1.2, 0.0, 0.0], "fr5": [3.0, -0.6, 0.3, -1.2, 0.0, 0.0]}
TOWARDS |= {"panda": [0.0, 0.6, 0.0, -1.2, 0.0, 1.5, 0.7], "piper": [0.0, 1.8, -1.2, 0.0, 0.3, 0.0]}


@pytest.mark.parametrize("robot", TOWARDS)
def test_two_arms_driven_together_touch_in_mujoco_and_in_the_checker(robot):
    q = {"left": TOWARDS[robot], "right": TOWARDS[robot]}
    still = {name: [row] for name, row in q.items()}
    seen = set()
    for distance in (1.9, 1.6, 1.4, 1.2, 1.0, 0.7):
        plan = tiny_plans.plan(two(robot, distance), still, times=[0.0])
        depth = touching(robot, distance, q)
        exact, spheres = ({v.rule for v in check_plan(plan, exact=on).violations} for on in (True, False))
        assert (depth is not None) == ("arm-arm" in exact)
        if depth is not None and depth > OUT_M:
            assert "arm-arm" in spheres
        seen.add(depth is not None)
    assert seen == {True, False}


@pytest.mark.parametrize("robot", TOWARDS)
@settings(max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_every_contact_in_mujoco_is_refuted_by_both_geometries(robot, seed):
    rng = np.random.default_rng(seed)
    q = {name: (TOWARDS[robot] + rng.uniform(-0.4, 0.4, len(TOWARDS[robot]))).tolist() for name in ("left", "right")}
    distance = float(rng.choice([0.6, 0.7, 0.8] if robot == "piper" else [0.9, 1.1, 1.3]))
    plan = tiny_plans.plan(two(robot, distance), {name: [row] for name, row in q.items()}, times=[0.0])
    depth = touching(robot, distance, q)
    exact = {violation.rule for violation in check_plan(plan, exact=True).violations}
    assert (depth is not None) == ("arm-arm" in exact)
    if depth is not None and depth > OUT_M:
        assert "arm-arm" in {violation.rule for violation in check_plan(plan).violations}


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_the_checkers_kinematics_are_those_of_the_robots_data(seed):
    arms = [
        tiny_plans.arm("one", [0.3, -0.2, 0.1], robot="panda", tool="franka-hand", yaw=0.4),
        tiny_plans.arm("two", [1.3, 0.2, 0.0], yaw=-2.0),
        tiny_plans.arm("three", [-1.0, 0.2, 0.0], robot="fr5"),
        tiny_plans.arm("four", [-1.0, 2.0, 0.3], robot="piper", yaw=1.0),
    ]
    model = CellModel(read_cell({"arms": arms}))
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, 25)
    poses = model.poses(np.zeros(1), q[None])
    first = 0
    for arm in cell_from_dict({"arms": arms}, "cell").arms:
        frames = link_frames(arm, q[first : first + arm.dof])
        first += arm.dof
        names = [*arm.robot.link_names, *([arm.tool.name] if arm.tool else [])]
        for name, frame in zip(names, frames, strict=True):
            body = model.mujoco.body(f"{arm.name}/{name}").id
            assert np.abs(poses.positions[0, body] - frame[:3, 3]).max() < 1e-6
            assert np.abs(poses.rotations[0, body] - frame[:3, :3]).max() < 1e-6


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_a_separating_direction_proves_what_mujoco_measures(seed):
    model = CellModel(read_cell({"arms": two("panda", 0.9)}))
    parts, clouds, ids = geom_parts(model)
    family = GeomPairs(model, parts, clouds, colliding_pairs(model, parts), ids)
    q = np.random.default_rng(seed).uniform(-1.5, 1.5, 14)
    track = PlacedTrajectory(model, Trajectory(np.zeros(1), q[None]), np.array([0.0, 1.0]))
    items = Items(steps=track.steps, step=np.zeros(len(family), dtype=int), pair=np.arange(len(family)))
    bounds = family.narrow(track.poses, items, np.inf)
    apart = bounds.found > 1e-4
    assert np.abs(bounds.found - bounds.lower)[apart].max() < 1e-5


def test_the_exact_check_passes_between_the_spheres_but_not_through_the_geoms():
    def beside_a_post(radius, *, exact):
        post = {"name": "post", "shape": "sphere", "radius": radius, "position": [-0.55, 0.0, 0.6]}
        arms = [tiny_plans.arm("arm", [0.0, 0.0, 0.0])]
        plan = tiny_plans.plan(arms, {"arm": [REACHING]}, times=[0.0], obstacles=[post])
        return check_plan(plan, exact=exact)

    spheres, geoms = (beside_a_post(0.15, exact=on).violations[0].values["clearance_m"] for on in (False, True))
    assert spheres < geoms - 0.003 < 0
    between = 0.15 + (spheres + geoms) / 2
    assert not beside_a_post(between, exact=False).valid
    assert beside_a_post(between, exact=True).valid
    assert not beside_a_post(between + 0.02, exact=True).valid
