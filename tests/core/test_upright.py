"""Bounds on tool axes in the core: angles, edges and projection against the reference implementation."""

from dataclasses import replace

import numpy as np
import pytest
from reference import kinematics, toys, upright
from support.upright_problems import upright_problem

from mmp_env import core
from mmp_env.errors import MmpError
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.keep import Upright
from mmp_env.model.rings import ring_cell
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.robot_folders import robot_names

AXES = ([0, 0, 1], [0, 0, -1], [1, 0, 0], [0.3, -0.5, 0.8])
BOUND_RAD = 1e-9


def largest_tilt(cell, q_from, q_to, samples=300):
    """Returns the largest angle [rad] at samples of each straight segment."""
    shares = np.linspace(0, 1, samples)[:, None]
    return np.array([cell.collision.tilt("arm", a + shares * (b - a)).max() for a, b in zip(q_from, q_to, strict=True)])


def lone(robot, axis, within, tool="default"):
    """Returns a cell of one arm whose base is turned and tilted, with a bound."""
    quaternion = np.array([0.9, 0.3, -0.2, 0.4])
    arm = place_arm("arm", robot, [0.1, -0.2, 0.3], quaternion, tool)
    return Cell(name="lone", arms=(arm,), keep={"arm": Upright(axis=axis, within=within)})


@pytest.mark.parametrize("tool", ["default", None])
@pytest.mark.parametrize("robot", robot_names())
def test_the_angle_agrees_with_the_reference(robot, tool):
    for seed, axis in enumerate(AXES):
        cell = lone(robot, axis, 0.5, tool)
        q = toys.random_configurations(np.random.default_rng(seed), cell.arms[0], 21)
        expected = [upright.tilt(cell.arms[0], axis, row) for row in q]
        np.testing.assert_allclose(cell.collision.tilt("arm", q), expected, rtol=0, atol=BOUND_RAD)


@pytest.mark.parametrize("within", [0.05, 0.2, 1.0, np.pi / 2])
@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_an_edge_is_free_if_and_only_if_it_keeps_the_bound(robot, within):
    """Edges whose largest angle is within 0.5 mrad of the bound may count as either."""
    rng = np.random.default_rng(5)
    for axis in AXES[1:3]:
        cell = lone(robot, axis, within)
        arm, model = cell.arms[0], cell.collision
        q, found = model.project_upright("arm", toys.random_configurations(rng, arm, 60))
        start = q[found]
        end = np.clip(start + rng.normal(0, 0.5 * np.sqrt(within), start.shape), arm.robot.lower, arm.robot.upper)
        largest = largest_tilt(cell, start, end)
        clear = replace(cell, keep={}).collision.edge_free("arm", start, end)
        free = model.edge_free("arm", start, end)
        assert clear.any()
        assert not free[~clear].any()
        assert (largest[free] <= within).all()
        assert free[clear & (largest < within - 5e-4)].all()
        assert (free & (largest > 0.5 * within)).any()


@pytest.mark.parametrize("robot", robot_names())
def test_a_projected_configuration_is_within_bound_and_limits_and_near(robot):
    rng = np.random.default_rng(6)
    for axis in AXES:
        cell = lone(robot, axis, 0.2)
        arm = cell.arms[0]
        q = toys.random_configurations(rng, arm, 50)
        moved, found = cell.collision.project_upright("arm", q)
        assert found.mean() > 0.5
        assert (moved >= arm.robot.lower).all()
        assert (moved <= arm.robot.upper).all()
        assert (cell.collision.tilt("arm", moved[found]) <= 0.2).all()
        again, still = cell.collision.project_upright("arm", moved[found])
        assert still.all()
        np.testing.assert_array_equal(again, moved[found])


def test_a_small_projection_follows_the_gradient():
    """A configuration just outside moves by little more than the least distance that the reference's gradient gives."""
    cell, axis = lone("panda", [0, 0, 1], 0.2), [0, 0, 1]
    rng = np.random.default_rng(7)
    arm = cell.arms[0]
    inside, found = cell.collision.project_upright("arm", toys.random_configurations(rng, arm, 30))
    for row in inside[found][:10]:
        start = np.clip(row + rng.normal(0, 0.05, arm.dof), arm.robot.lower + 0.1, arm.robot.upper - 0.1)
        at = upright.tilt(arm, axis, start)
        if at <= 0.2:
            continue
        slope = [(upright.tilt(arm, axis, start + step) - at) / 1e-6 for step in 1e-6 * np.eye(arm.dof)]
        (moved,), (done,) = cell.collision.project_upright("arm", start[None])
        assert done
        assert np.linalg.norm(moved - start) < 1.5 * (at - 0.7 * 0.2) / np.linalg.norm(slope)


@pytest.mark.parametrize("seed", range(3))
def test_searches_keep_the_bound_at_every_instant(seed):
    problem = upright_problem(ring_cell(2), seed)
    levels = problem.levels(1.0, 0.5)
    paths = []
    for k, name in enumerate(problem.cell.arm_names):
        search = core.SingleArm(
            problem.cell.collision.core,
            k,
            start=problem.start[name],
            goals=problem.goal[name][None],
            max_step=np.full(6, 0.08),
            levels=levels,
            seed=seed,
        )
        rows, _ = search.plan([], seed, core.Clock(60.0))
        assert rows is not None
        paths.append((name, rows))
    start, goal = (
        np.concatenate([ends[name] for name in problem.cell.arm_names]) for ends in (problem.start, problem.goal)
    )
    composite = core.CompositeSearch(
        problem.cell.collision.core,
        start=start,
        goals=goal[None],
        samples=levels,
        edges=problem.levels(0.5, 0.2),
        seed=seed,
    )
    rows = composite.grow(20000, core.Clock(60.0))
    assert rows is not None
    paths += [(name, rows[:, 6 * k : 6 * k + 6]) for k, name in enumerate(problem.cell.arm_names)]
    for name, path in paths:
        shares = np.linspace(0, len(path) - 1, 20 * len(path))
        dense = np.column_stack([np.interp(shares, np.arange(len(path)), joint) for joint in path.T])
        assert problem.cell.collision.tilt(name, dense).max() <= problem.keep[name].within


def wrist_turned_over(q):
    """Returns another configuration of a UR5e with the same pose of the flange; the way there tilts the flange."""
    return q + np.array([0, 0, 0, np.pi, -2 * q[4], np.pi])


def test_a_certificate_refuses_an_excursion_between_two_upright_ends():
    arm = place_arm("arm", "ur5e", [0, 0, 0], quaternion_from_yaw(0.0), None)
    home = np.array([0.0, -1.2, 1.0, -0.4, 0.3, 0.5])
    axis = kinematics.flange_frame(arm, home)[:3, :3].T @ [0, 0, 1]
    cell = Cell(name="lone", arms=(arm,), keep={"arm": Upright(axis=axis, within=0.2)})
    over, turned = wrist_turned_over(home), home + 0.5 * np.eye(6)[0]
    assert cell.collision.tilt("arm", np.array([home, over])).max() < 1e-6
    assert largest_tilt(cell, home[None], over[None])[0] > 0.5
    levels = core.Levels(0.001, 0.001, 0.0, 0.0, -0.001)
    for kept, end, valid in ((cell, turned, True), (cell, over, False), (replace(cell, keep={}), over, True)):
        proof = core.certify(kept.collision.core, [np.array([home, end])], levels, 0.5, core.Clock(60.0))
        assert proof.valid == valid
        if not valid:
            assert (proof.arm_a, proof.arm_b) == (0, -1)


def test_an_arm_without_a_bound_has_no_angle():
    cell = replace(lone("ur5e", [0, 0, 1], 0.2), keep={})
    with pytest.raises(MmpError, match="arm 'arm' has no bound on the angle of its tool"):
        cell.collision.tilt("arm", np.zeros((1, 6)))
