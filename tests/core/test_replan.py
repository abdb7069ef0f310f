"""Large-neighbourhood search: removes detours, makes another arm give room, and keeps the plan safe."""

import numpy as np
import pytest
from reference import clearance
from support import two_arms

from mmp_env import check_plan, core, draw_instance, ring_cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.problems.making import make_problem
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.shortcutting import retime_to_velocity_limits
from mmp_planners.rrt_connect import RrtConnect

DT_S = 0.1


def replanned(problem, rows, attempts=40, seed=0, clock=None):
    names = problem.cell.arm_names
    speeds = [problem.max_velocity[name] * DT_S for name in names]
    clock = clock or core.Clock(np.inf)
    levels = problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR)
    return core.replan(
        problem.cell.collision.core,
        rows,
        speeds,
        goals=[problem.goals[name] for name in names],
        levels=levels,
        attempts=attempts,
        seed=seed,
        clock=clock,
    )


def length(rows):
    return sum(np.abs(np.diff(q, axis=0)).sum() for q in rows)


def straight(q_from, q_to, steps):
    return np.asarray(q_from) + np.linspace(0, 1, steps + 1)[:, None] * (np.asarray(q_to) - q_from)


def lifted_over(problem):
    """Returns a detour of the left arm over the place of the right arm, 40 steps up and 40 down."""
    start, goal = problem.start["left"], problem.goal["left"]
    via = two_arms.reaching(0.0) + np.array([0.0, -0.9, -0.6, 0.0, 0.0, 0.0])
    return np.vstack([straight(start, via, 40), straight(via, goal, 40)[1:]])


def first_come():
    """Returns a plan in which the right arm moves first and blocks the left arm, which lifts over it."""
    problem = two_arms.turning((0.8, -0.8), (0.8, 0.0))
    come = straight(problem.start["right"], problem.goal["right"], 10)
    right = np.vstack([come, np.repeat(come[-1:], 70, axis=0)])
    return problem, [lifted_over(problem), right]


def blocked_by_parked_arm():
    problem = two_arms.parked_arm_between()
    return problem, [lifted_over(problem), np.repeat(problem.start["right"][None], 81, axis=0)]


def test_an_arm_is_delayed_if_this_spares_another_arm_a_detour():
    problem, rows = first_come()
    assert check_plan(retime_to_velocity_limits(problem, rows)).valid
    found, kept = replanned(problem, rows)
    assert kept > 0
    assert length(found) == pytest.approx(problem.cost_lower_bound_rad, abs=1e-3)
    assert check_plan(retime_to_velocity_limits(problem, found)).valid
    left, right = found
    passed = np.flatnonzero(left[:, 0] < np.pi - 0.1)[0]  # the first axis beyond the middle
    assert right[passed, 0] > np.pi + 0.1


@pytest.mark.parametrize("seed", range(3))
def test_a_shorter_path_stays_clear_by_the_reference(seed):
    problem, rows = blocked_by_parked_arm()
    found, kept = replanned(problem, rows, seed=seed)
    assert kept > 0
    assert problem.cost_lower_bound_rad < length(found) < length(rows)
    gap = clearance.clearance_of_motions(problem.cell, "left", found[0], "right", found[1])
    assert gap >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - 1e-5


def test_ends_and_velocity_limits_are_kept():
    for problem, rows in (first_come(), blocked_by_parked_arm()):
        found, _ = replanned(problem, rows)
        assert len(found[0]) == len(found[1])
        for name, before, after in zip(problem.cell.arm_names, rows, found, strict=True):
            np.testing.assert_array_equal(after[[0, -1]], before[[0, -1]].astype(np.float32))
            assert (np.abs(np.diff(after, axis=0)) <= problem.max_velocity[name] * DT_S * (1 + 1e-4)).all()


def test_the_same_seed_gives_the_same_plan():
    problem, rows = blocked_by_parked_arm()
    (first, kept), (second, again) = (replanned(problem, rows, seed=5) for _ in range(2))
    assert kept == again
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_plans_of_four_crowded_arms_get_shorter_and_stay_valid():
    cell = ring_cell(4, "panda")
    problem = make_problem(cell, *draw_instance(cell, seed=2))
    plan = RrtConnect(shorten=100).plan(problem, seed=0).plan
    shorter, kept = LargeNeighbourhoodSearch(attempts=40)(plan, 0, core.Clock(np.inf))
    assert kept > 0
    assert shorter.cost_rad < plan.cost_rad
    assert check_plan(shorter).valid


def test_without_attempts_time_or_detours_a_plan_stays_as_it_is():
    problem, rows = blocked_by_parked_arm()
    cancelled = core.Clock(np.inf)
    cancelled.cancel()
    straight_on = two_arms.one_moves()
    open_rows = [straight(straight_on.start[n], straight_on.goal[n], 5) for n in straight_on.cell.arm_names]
    for problem_, before, options in (
        (problem, rows, {"attempts": 0}),
        (problem, rows, {"clock": cancelled}),
        (straight_on, open_rows, {}),
    ):
        found, kept = replanned(problem_, before, **options)
        assert kept == 0
        for a, b in zip(found, before, strict=True):
            np.testing.assert_array_equal(a, b.astype(np.float32))


def test_rows_that_do_not_match_are_refused():
    problem, rows = blocked_by_parked_arm()
    with pytest.raises(ValueError, match="the same number of rows"):
        replanned(problem, [rows[0], rows[1][:-1]])
    with pytest.raises(ValueError, match="one array per arm"):
        replanned(problem, rows[:1])
