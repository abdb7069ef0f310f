"""Sphere centres and tool points of the core against the reference implementation, in double precision."""

import numpy as np
import pytest
from reference import clearance, kinematics, toys

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import SPHERE_SETS
from mmp_env.robot_folders import robot_names

PRECISE_M = 1e-9
COUNT = 21  # not a multiple of any number of vector lanes


def tilted_cell(rng, robot, spheres):
    """Returns a cell of one arm with a random base pose."""
    arm = place_arm("arm", robot, rng.uniform(-1, 1, 3), toys.random_rotation(rng))
    return Cell(name="tilted", arms=(arm,), spheres=spheres)


@pytest.mark.parametrize("spheres", SPHERE_SETS)
@pytest.mark.parametrize("robot", robot_names())
def test_sphere_centres_agree_with_the_reference(robot, spheres):
    rng = np.random.default_rng(21)
    cell = tilted_cell(rng, robot, spheres)
    q = toys.random_configurations(rng, cell.arms[0], COUNT)
    centers, radii = cell.collision.spheres("arm", q)
    links = cell.collision.sphere_links("arm")
    names = kinematics.part_names(cell.arms[0])
    for k in range(COUNT):
        expected = clearance.cloud(cell, cell.arms[0], q[k])
        assert sorted(names[part] for part in expected.parts) == sorted(links)
        found = np.column_stack([centers[k], radii, [names.index(link) for link in links]])
        rows = np.column_stack([expected.centers, expected.radii, expected.parts])
        # The core keeps its own order: every sphere has exactly one like it.
        nearest = np.abs(found[:, None] - rows[None]).max(axis=2)
        assert nearest.min(axis=1).max() <= PRECISE_M
        assert sorted(nearest.argmin(axis=1)) == list(range(len(rows)))


@pytest.mark.parametrize("spheres", SPHERE_SETS)
@pytest.mark.parametrize("robot", robot_names())
def test_the_spheres_of_the_base_come_first(robot, spheres):
    cell = tilted_cell(np.random.default_rng(22), robot, spheres)
    links = cell.collision.sphere_links("arm")
    count = int((cell.arms[0].robot.spheres[spheres].links == 0).sum())
    assert [link == cell.arms[0].robot.link_names[0] for link in links] == [k < count for k in range(len(links))]


@pytest.mark.parametrize("tool", ["default", None])
@pytest.mark.parametrize("robot", robot_names())
def test_tool_points_agree_with_the_reference(robot, tool):
    rng = np.random.default_rng(23)
    arm = place_arm("arm", robot, rng.uniform(-1, 1, 3), toys.random_rotation(rng), tool)
    q = toys.random_configurations(rng, arm, COUNT)
    found = Cell(name="one", arms=(arm,)).collision.tool_points("arm", q)
    np.testing.assert_allclose(found, [kinematics.tool_point(arm, row) for row in q], rtol=0, atol=PRECISE_M)


def test_joint_axes_need_not_be_z():
    rng = np.random.default_rng(24)
    axes = np.array([[0.0, 0, -1], [0.6, 0, 0.8]])
    cell = toys.toy_cell(toys.toy_arm("a", [0.1, 0.2, 0.3], 0.4, toys.toy_tool(), axes=axes))
    q = rng.uniform(-np.pi, np.pi, (COUNT, 2))
    found, _ = cell.collision.spheres("a", q)
    for k in range(COUNT):
        np.testing.assert_allclose(found[k], clearance.cloud(cell, cell.arms[0], q[k]).centers, rtol=0, atol=PRECISE_M)
    expected = [kinematics.tool_point(cell.arms[0], row) for row in q]
    np.testing.assert_allclose(cell.collision.tool_points("a", q), expected, rtol=0, atol=PRECISE_M)


def test_angles_of_many_turns_are_reduced_exactly():
    cell = tilted_cell(np.random.default_rng(25), "ur5e", "28")
    q = toys.random_configurations(np.random.default_rng(26), cell.arms[0], COUNT)
    turns = np.random.default_rng(27).integers(-50, 50, q.shape)
    found, _ = cell.collision.spheres("arm", q + 2 * np.pi * turns)
    expected, _ = cell.collision.spheres("arm", q)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)


def test_no_configuration_gives_no_points():
    cell = tilted_cell(np.random.default_rng(28), "panda", "28")
    assert cell.collision.tool_points("arm", np.zeros((0, 7))).shape == (0, 3)
    centers, radii = cell.collision.spheres("arm", np.zeros((0, 7)))
    assert centers.shape == (0, len(radii), 3)


@pytest.mark.parametrize("q", [np.zeros((3, 6)), np.zeros(7), np.zeros((1, 1, 7))])
def test_a_wrong_number_of_joints_is_named(q):
    cell = tilted_cell(np.random.default_rng(29), "panda", "28")
    with pytest.raises(MmpError, match=r"configurations of arm 'arm' have shape .*; expected \[n, 7\]"):
        cell.collision.tool_points("arm", q)


def test_an_unknown_arm_is_named():
    cell = tilted_cell(np.random.default_rng(30), "panda", "28")
    with pytest.raises(UnknownNameError, match="unknown arm 'arn'"):
        cell.collision.tool_points("arn", np.zeros((1, 7)))
