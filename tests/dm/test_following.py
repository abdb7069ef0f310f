"""A plan as a policy, in a loop and in the viewer of dm_control."""

import numpy as np
import pytest
from dm_control.viewer import runtime

import mmp_planners
from mmp_env import dm
from mmp_env.errors import MmpError


@pytest.fixture(scope="module")
def plan():
    environment = dm.load("MultiArmCell-4", random=7)
    environment.reset()
    result = mmp_planners.make("apf-ecbs").plan(environment.task.problem, seed=7)
    assert result.plan is not None
    return result.plan


def test_a_plan_is_followed_to_the_goal_without_a_contact(plan):
    environment = dm.load("MultiArmCell-4", random=7)
    policy, time_step = dm.follow(environment, plan), environment.reset()
    contacts = []
    while not time_step.last():
        time_step = environment.step(policy(time_step))
        contacts += environment.task.contacts
    assert environment.task.is_success
    assert contacts == []
    assert environment.physics.time() <= plan.makespan_s + 0.1


def test_dm_controls_viewer_shows_a_plan_and_restarts(plan):
    environment = dm.load("MultiArmCell-4", random=7)
    shown = runtime.Runtime(environment, dm.follow(environment, plan))
    errors = []
    shown.on_error += errors.append
    shown.tick(0.0, False)
    shown.tick(0.5, True)
    assert environment.physics.time() == 0.0
    for _ in range(20):
        shown.tick(1 / 30, False)
    assert environment.physics.time() == pytest.approx(20 / 30, abs=0.2)
    environment.task.random = np.random.default_rng(0)
    shown.single_step()
    assert errors == []
    assert shown.state is runtime.State.RUNNING


def test_a_plan_of_another_episode_is_refused(plan):
    environment = dm.load("MultiArmCell-4", random=8)
    policy = dm.follow(environment, plan)
    with pytest.raises(MmpError, match="begins elsewhere than the plan"):
        policy(environment.reset())


def test_a_plan_of_another_cell_is_refused(plan):
    with pytest.raises(MmpError, match="the plan is for another cell"):
        dm.follow(dm.load("MultiArmCell-2"), plan)


def test_a_plan_for_some_of_the_arms_is_refused(plan):
    from dataclasses import replace

    cell = plan.problem.cell
    fewer = replace(plan.problem, cell=replace(cell, arms=cell.arms[:3]))
    part = replace(plan, problem=fewer, positions={name: plan.positions[name] for name in fewer.cell.arm_names})
    with pytest.raises(MmpError, match="does not say where arm 'arm3' goes"):
        dm.follow(dm.load("MultiArmCell-4"), part)


def test_other_control_modes_and_other_environments_cannot_follow(plan):
    from dm_control import suite

    with pytest.raises(MmpError, match="control_mode='position' alone"):
        dm.follow(dm.load("MultiArmCell-4", control_mode="delta"), plan)
    with pytest.raises(MmpError, match=r"load the environment with mmp_env\.dm\.load"):
        dm.follow(suite.load("reacher", "easy"), plan)


def test_following_the_missing_plan_of_a_failed_planner_is_an_error():
    with pytest.raises(MmpError, match="there is no plan to follow"):
        dm.follow(dm.load("MultiArmCell-2", random=3), None)
