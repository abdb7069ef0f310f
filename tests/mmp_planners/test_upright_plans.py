"""Planners keep tools upright, and so do retimed plans: tested with MuJoCo's kinematics and by the checker."""

import mujoco
import numpy as np
import pytest
from support.upright_problems import upright_problem

import mmp_planners
from mmp_env import check_plan
from mmp_env.model.rings import ring_cell
from mmp_env.retime import retime
from mmp_env.sim.scene import compile_scene


def largest_tilt(plan, step_s=0.01):
    """Returns the largest angle [rad] of any tool axis over its bound, by MuJoCo's kinematics."""
    cell = plan.problem.cell
    model = compile_scene(cell)
    data, worst = mujoco.MjData(model), 0.0
    for time in np.arange(0.0, plan.makespan_s + step_s, step_s):
        state = plan.at(min(time, plan.makespan_s))
        for arm in cell.arms:
            for k, value in enumerate(state[arm.name]):
                data.joint(f"{arm.name}/joint{k + 1}").qpos = value
        mujoco.mj_kinematics(model, data)
        for name, bound in cell.keep.items():
            tool = cell.arm(name).tool
            frame = data.body(f"{name}/{tool.name}") if tool else data.site(f"{name}/flange")
            x, y, z = frame.xmat.reshape(3, 3) @ bound.direction
            worst = max(worst, np.arctan2(np.hypot(x, y), z) / bound.within)
    return worst


@pytest.mark.parametrize("planner", ["auto", "apf-ecbs", "prioritized", "rrt-connect", "group-rrt"])
def test_a_planner_keeps_tools_upright(planner):
    problem = upright_problem(ring_cell(4), 1)
    plan = mmp_planners.make(planner).plan(problem, seed=1, time_limit=60).plan
    assert plan is not None
    assert check_plan(plan).violations == ()
    assert largest_tilt(plan, 0.05) <= 1


@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_retiming_keeps_tools_upright(robot):
    problem = upright_problem(ring_cell(2, robot=robot), 2)
    plan = mmp_planners.make("auto").plan(problem, seed=2, time_limit=60).plan
    assert plan is not None
    assert plan.cost_rad > 1.01 * problem.cost_lower_bound_rad  # not along straight lines
    smooth = retime(plan)
    assert check_plan(smooth).violations == ()
    assert largest_tilt(smooth) <= 1


def test_the_same_seed_gives_the_same_upright_plan():
    problem = upright_problem(ring_cell(2), 3)
    first, again = (mmp_planners.make("auto").plan(problem, seed=3, time_limit=60).plan for _ in range(2))
    for name in problem.cell.arm_names:
        np.testing.assert_array_equal(first.positions[name], again.positions[name])
