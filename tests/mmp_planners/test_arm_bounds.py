"""Bounds of an arm: the Lipschitz constant of its spheres, tight to a factor of two."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import toys
from reference.clearance import cloud

from mmp_env.model.rings import ring_cell
from mmp_env.model.robot import SPHERE_SETS
from mmp_planners.arm_bounds import lipschitz

ROBOTS = ("ur5e", "panda", "fr5", "piper")
CELLS = {(robot, spheres): ring_cell(2, robot, spheres) for robot in ROBOTS for spheres in SPHERE_SETS}


def moved(cell, q, to):
    """Returns how far the spheres move from one configuration to another [m]."""
    a, b = (cloud(cell, cell.arms[0], at).centers for at in (q, to))
    return float(np.linalg.norm(b - a, axis=1).max())


@given(robot=st.sampled_from(ROBOTS), spheres=st.sampled_from(SPHERE_SETS), seed=st.integers(0, 10**6))
def test_no_sphere_moves_more_than_the_bound_times_the_largest_joint_motion(robot, spheres, seed):
    cell, random = CELLS[robot, spheres], np.random.default_rng(seed)
    arm = cell.arms[0]
    q = random.uniform(arm.robot.lower, arm.robot.upper)
    step = random.uniform(-1, 1, arm.dof) * 10 ** random.uniform(-4, 0)
    if seed % 2:
        step = np.sign(step) * np.abs(step).max()
    assert moved(cell, q, q + step) <= lipschitz(arm, spheres) * np.abs(step).max() + 1e-12


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_bound_is_less_than_twice_what_an_arm_can_do(robot):
    cell, random = CELLS[robot, "28"], np.random.default_rng(0)
    arm, step = cell.arms[0], 1e-3
    most = max(
        moved(cell, q := random.uniform(arm.robot.lower, arm.robot.upper), q + step * random.choice([-1, 1], arm.dof))
        for _ in range(3000)
    )
    assert lipschitz(arm, "28") < 2 * most / step


def test_the_constant_of_a_planar_arm_is_the_sum_of_the_distances_to_its_tip():
    """The arm has two links of 1 m. Its tip is 2 m from the first axis and 1 m from the second."""
    cell = toys.toy_cell(toys.toy_arm("toy", [0, 0, 0]))
    arm = cell.arms[0]
    stretched = np.zeros(arm.dof)
    step = 1e-6
    assert lipschitz(arm, cell.spheres) == pytest.approx(moved(cell, stretched, stretched + step) / step, rel=1e-4)
