"""Mixed arms: every function that takes a cell works with two FR5, two PiPER and a Panda."""

import dataclasses
from itertools import combinations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mmp_planners
from mmp_env import check_plan, draw_problem, find_cell, place_arm
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_env.model.transforms import quaternion_from_yaw
from mmp_env.retime import retime
from mmp_env.sim.simulation import Simulation


@pytest.fixture(scope="module")
def with_panda():
    """Returns the mixed cell with a Panda at a corner of the table, out of reach of the other bases."""
    mixed = find_cell("mixed-4")
    panda = place_arm("panda", "panda", [0.55, 0.6, 0.0], quaternion_from_yaw(-2.2))
    return dataclasses.replace(mixed, name="mixed-5", arms=(*mixed.arms, panda))


def test_the_cell_has_two_arms_of_each_sort_within_a_metre_and_a_half():
    cell = find_cell("mixed-4")
    assert [arm.robot.name for arm in cell.arms] == ["fr5", "piper", "fr5", "piper"]
    apart = [np.linalg.norm(a.position - b.position) for a, b in combinations(cell.arms, 2)]
    assert max(apart) <= 1.5
    assert min(apart) >= 0.75


def test_every_two_arms_reach_a_common_place():
    cell = find_cell("mixed-4")
    for a, b in combinations(cell.arms, 2):
        assert np.linalg.norm(a.position - b.position) < a.robot.reach + b.robot.reach - 0.2


def test_all_stand_clear_of_each_other_tucked_and_at_home():
    cell = find_cell("mixed-4")
    for pose in ("tucked", "home"):
        assert cell.collision.least_clearance({a.name: getattr(a.robot, pose) for a in cell.arms})[0] > 0.005


def test_the_environment_obeys_gymnasium_and_refuses_another_robot():
    env = gymnasium.make("MultiArmCell-mixed-4")
    check_env(env.unwrapped, skip_render_check=True)
    assert env.unwrapped.action_space.shape == (24,)
    with pytest.raises(MmpError, match="cell 'mixed-4' already says which arms it has"):
        gymnasium.make("MultiArmCell-mixed-4", robot="panda")


def test_an_unknown_cell_is_answered_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'mixed-4'"):
        find_cell("mixed4")


def test_arms_of_six_and_seven_joints_are_planned_checked_and_executed_together(with_panda):
    cell = cell_from_dict(cell_to_dict(with_panda), "cell")
    problem = draw_problem(cell, "reach", 2)
    plan = mmp_planners.make("auto").plan(problem, seed=2, time_limit=60).plan
    assert {name: rows.shape[1] for name, rows in plan.positions.items()} == {
        "arm0": 6,
        "arm1": 6,
        "arm2": 6,
        "arm3": 6,
        "panda": 7,
    }
    assert check_plan(plan).valid
    again = plan_from_dict(plan_to_dict(plan))
    env = gymnasium.make("MultiArmCell", cell=cell).unwrapped
    env.reset(options={"start": problem.start, "goal": problem.goal})
    report = env.execute(retime(again))
    assert report.reached
    assert report.contacts == []


@pytest.mark.parametrize("planner", ["apf-ecbs", "prioritized", "rrt-connect"])
def test_planners_take_arms_of_different_numbers_of_joints(with_panda, planner):
    problem = draw_problem(with_panda, "reach", 1)
    result = mmp_planners.make(planner).plan(problem, seed=1, time_limit=30)
    assert result.plan is not None
    assert check_plan(result.plan).valid


def test_a_task_that_furnishes_the_cell_obeys_gymnasium():
    env = gymnasium.make("MultiArmCell-2", task="pick").unwrapped
    check_env(env, skip_render_check=True)


def test_each_reset_has_the_objects_of_its_own_instance():
    env = gymnasium.make("MultiArmCell-mixed-4", task="place").unwrapped
    bare = {obstacle.name for obstacle in env.cell.obstacles}
    env.reset(seed=1)
    first = env.cell
    assert {obstacle.name for obstacle in first.obstacles} > bare
    assert all(arm.held for arm in first.arms)
    env.reset(seed=2)
    assert cell_to_dict(env.cell) != cell_to_dict(first)
    env.reset(seed=1)
    assert cell_to_dict(env.cell) == cell_to_dict(first)
    assert cell_to_dict(env.problem.cell) == cell_to_dict(draw_problem(find_cell("mixed-4"), "place", 1).cell)
    assert env.model.geom("arm0/held").bodyid > 0
    tucked = {arm.name: arm.robot.tucked for arm in env.cell.arms}
    env.reset(options={"start": tucked, "goal": tucked})
    assert {obstacle.name for obstacle in env.cell.obstacles} == bare


def test_a_simulation_of_mixed_arms_keeps_their_joints_apart(with_panda):
    simulation = Simulation(with_panda)
    assert [(s.start, s.stop) for s in simulation.slices.values()] == [(0, 6), (6, 12), (12, 18), (18, 24), (24, 31)]
