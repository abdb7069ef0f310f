"""The motion reference samples edges and steps densely: values for toy arms, bounds for real arms."""

import numpy as np
import pytest
from reference import clearance, motion, toys

from mmp_env.model.arm import place_arm
from mmp_env.robot_folders import robot_names


def facing_arms():
    """Returns a cell of two arms whose tips touch at x = 2 when both are stretched along the x axis."""
    return toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi))


def test_an_edge_through_an_obstacle_is_found_though_both_ends_are_free():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), obstacles=[toys.solid("sphere", [2, 0, 0], radius=0.05)])
    before, after = np.array([-0.5, 0]), np.array([0.5, 0])
    assert min(clearance.static_clearance(cell, "a", q) for q in (before, after)) > 0.5
    assert motion.edge_clearance(cell, "a", before, after) == pytest.approx(-0.15)


def test_a_step_in_which_two_tips_swap_places_is_a_conflict():
    cell = facing_arms()
    up, down = np.array([0.5, 0]), np.array([-0.5, 0])
    assert clearance.pair_clearance(cell, "a", up, "b", up) > 0.5
    assert motion.step_clearance(cell, "a", up, down, "b", up, down) == pytest.approx(-0.2)
    assert motion.conflicting_steps(cell, "a", [up, down], "b", [up, down], margin=0.002) == [0]


def test_a_conflict_is_a_clearance_below_the_margin():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4.3, 0, 0], yaw=np.pi))
    path = [np.zeros(2), np.zeros(2)]
    assert motion.conflicting_steps(cell, "a", path, "b", path, margin=0.099) == []
    assert motion.conflicting_steps(cell, "a", path, "b", path, margin=0.101) == [0]


def test_a_finished_arm_stays_at_its_goal_and_still_collides():
    cell = facing_arms()
    parked = [np.array([0.3, 0]), np.array([0.0, 0])]
    passing = [np.array([x, 0]) for x in (-1.5, -1.0, -0.5, 0.5, 1.0)]
    assert motion.conflicting_steps(cell, "a", passing, "b", parked, margin=0.002) == [2]
    assert motion.conflicting_steps(cell, "b", parked, "a", passing, margin=0.002) == [2]


@pytest.mark.parametrize("name", robot_names())
def test_no_sphere_travels_farther_than_the_bound(name):
    rng = np.random.default_rng(8)
    cell = toys.random_cell(rng, [name, name], "28", obstacles=False)
    arm = cell.arms[0]
    for _ in range(20):
        q_from, q_to = toys.random_configurations(rng, arm, 2)
        clouds = [clearance.cloud(cell, arm, q).centers for q in motion.along(q_from, q_to, 20)]
        travelled = np.linalg.norm(np.diff(clouds, axis=0), axis=-1).sum(axis=0)
        assert travelled.max() <= motion.travel_bound(arm, "28", q_to - q_from)


@pytest.mark.parametrize("name", robot_names())
def test_a_finer_sampling_finds_no_less_than_the_slack_allows(name):
    rng = np.random.default_rng(9)
    cell = toys.random_cell(rng, [name, name], "28")
    rounding = 1e-12
    for _ in range(3):
        a_from, a_to = toys.random_configurations(rng, cell.arms[0], 2)
        b_from, b_to = toys.random_configurations(rng, cell.arms[1], 2)
        rough, fine = (motion.edge_clearance(cell, "arm0", a_from, a_to, samples) for samples in (8, 40))
        assert rough - motion.edge_slack(cell, "arm0", a_from, a_to, 8) <= fine <= rough + rounding
        step = ("arm0", a_from, a_to, "arm1", b_from, b_to)
        rough, fine = (motion.step_clearance(cell, *step, samples=samples) for samples in (8, 40))
        assert rough - motion.step_slack(cell, *step, samples=8) <= fine <= rough + rounding


def test_the_tool_adds_to_the_reach_of_the_last_joints():
    bare, armed = (place_arm("a", "panda", [0, 0, 0], [1, 0, 0, 0], tool=tool) for tool in (None, "franka-hand"))
    assert (motion.farthest_reach(armed, "28") > motion.farthest_reach(bare, "28")).all()
