"""Shortcutting as a part that planners are composed with."""

import math

import numpy as np
import pytest
import two_arms

import mmp_planners
from mmp_env import _core
from mmp_env.check import check_plan
from mmp_env.instances import draw_instance
from mmp_env.plan import Plan
from mmp_env.problem import make_problem
from mmp_env.rings import ring_cell
from mmp_planners.shortcutting import Shortcutting, on_grid, paced


def ring(arms=4, seed=2):
    cell = ring_cell(arms)
    return make_problem(cell, *draw_instance(cell, seed=seed))


@pytest.mark.parametrize("planner", ["rrt-connect", "prioritized", "apf-ecbs"])
def test_a_shortened_plan_costs_no_more_and_passes_the_checker(planner):
    problem = ring()
    long = mmp_planners.make(planner).plan(problem, seed=1)
    short = mmp_planners.make(planner, shorten=300).plan(problem, seed=1)
    assert short.plan.cost_rad <= long.plan.cost_rad + 1e-9
    assert check_plan(short.plan).valid
    assert short.stats["cost_rad"] == pytest.approx(short.plan.cost_rad)


def test_composite_plans_become_much_shorter():
    problem = ring(6, 4)
    long = mmp_planners.make("rrt-connect").plan(problem, seed=0)
    short = mmp_planners.make("rrt-connect", shorten=600).plan(problem, seed=0)
    assert short.stats["shortcuts"] > 0
    assert short.stats["cost_ratio"] < 1.1 < long.stats["cost_ratio"]


def test_steps_take_as_long_as_their_slowest_joint_and_no_longer():
    problem = two_arms.passing()
    rows = [
        np.array([problem.start[n], (problem.start[n] + problem.goal[n]) / 2, problem.goal[n]])
        for n in problem.cell.arm_names
    ]
    plan = paced(problem, rows)
    np.testing.assert_allclose(plan.times, [0.0, 1.0, 2.0], atol=1e-9)  # 0.8 rad each at 0.8 rad/s


def test_steps_in_which_nothing_moves_are_left_out():
    problem = two_arms.passing()
    rows = [np.array([problem.start[n]] * 3 + [problem.goal[n]] * 3) for n in problem.cell.arm_names]
    plan = paced(problem, rows)
    assert len(plan.times) == 2
    np.testing.assert_array_equal(plan.positions["left"], [problem.start["left"], problem.goal["left"]])


def test_arms_that_never_move_have_a_plan_of_no_length():
    problem = two_arms.nothing_to_do()
    plan = paced(problem, [np.array([problem.start[n]] * 4) for n in problem.cell.arm_names])
    assert plan.makespan_s == 0
    assert plan.cost_rad == 0


def test_a_grid_has_every_corner_of_the_plan():
    problem = two_arms.passing()
    times = np.array([0.0, 0.25, 0.31, 2.5])
    q = {
        n: np.array([problem.start[n], problem.start[n] + 0.01, problem.start[n] - 0.01, problem.goal[n]])
        for n in problem.cell.arm_names
    }
    rows = on_grid(Plan(problem=problem, times=times, positions=q), 0.1)
    for name, grid in zip(problem.cell.arm_names, rows, strict=True):
        assert len(grid) == 1 + 3 + 1 + 22
        np.testing.assert_allclose(grid[[0, 3, 4, -1]], q[name])


def test_a_cancelled_clock_leaves_the_plan():
    problem = ring()
    plan = mmp_planners.make("rrt-connect").plan(problem, seed=0).plan
    clock = _core.Clock(math.inf)
    clock.cancel()
    found, kept = Shortcutting(attempts=100_000)(plan, 0, clock)
    assert kept < 10
    assert found.cost_rad <= plan.cost_rad + 1e-9
