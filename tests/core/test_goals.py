"""Searches with several goals: which one a path ends at, goals that are blocked for ever, and goals that change."""

import numpy as np
import pytest
from support import two_arms

from mmp_env import JointGoal, core
from mmp_env.model.goals import AnyOf
from mmp_env.problems.making import make_problem

LEVELS = core.Levels(0.002, 0.0015)
STEP = np.full(6, 0.08)
START, RIGHT = two_arms.reaching(0.6), two_arms.reaching(1.0)
NEAR, MIDDLE, FAR = (two_arms.reaching(pan) for pan in (0.2, 1.3, -0.6))
GOALS = np.stack([FAR, NEAR, MIDDLE])
CELL = two_arms.facing_cell()


def clock():
    return core.Clock(60.0)


def planner(goals=GOALS, seed=0):
    return core.SingleArm(
        CELL.collision.core, 0, start=START, goals=np.ascontiguousarray(goals), max_step=STEP, levels=LEVELS, seed=seed
    )


def end(constraints=(), goals=GOALS, **options):
    path = planner(goals).plan(list(constraints), 1, clock(), **options)[0]
    return None if path is None else path[-1]


def never_at(q, start=0):
    return core.Constraint.ball(q, 0.1, start, core.FOREVER)


def test_a_path_ends_at_the_nearest_goal_in_any_order_of_the_goals():
    for goals in (GOALS, GOALS[::-1], np.roll(GOALS, 1, axis=0)):
        np.testing.assert_allclose(end(goals=goals), NEAR, atol=1e-6)


def test_goals_that_are_forbidden_for_ever_are_left_out():
    np.testing.assert_allclose(end([never_at(NEAR)]), MIDDLE, atol=1e-6)
    np.testing.assert_allclose(end([never_at(NEAR, 500), never_at(MIDDLE)]), FAR, atol=1e-6)
    assert end([never_at(q) for q in GOALS]) is None


def test_a_goal_that_is_forbidden_for_a_while_stays_a_goal():
    while_moving = core.Constraint.ball(NEAR, 0.1, 0, 8)
    np.testing.assert_allclose(end([while_moving], goals=[NEAR]), NEAR, atol=1e-6)
    assert end([while_moving]) is not None


def test_a_goal_where_another_arm_ends_is_left_out():
    stays = core.Motion(CELL.collision.core, 1, np.repeat(two_arms.reaching(0.0)[None], 2, axis=0))
    goals = np.stack([two_arms.reaching(0.0), FAR, MIDDLE])
    np.testing.assert_allclose(end(goals=goals, others=[stays]), MIDDLE, atol=1e-6)


def test_goals_in_collision_are_left_out():
    bent = two_arms.reaching(0.6)
    bent[2] = 3.1  # the forearm in the upper arm
    assert not CELL.collision.is_free("left", bent[None])[0]
    np.testing.assert_allclose(end(goals=[bent, FAR]), FAR, atol=1e-6)
    assert end(goals=[bent, bent]) is None


def test_an_earlier_path_is_followed_to_its_own_goal():
    known = planner([FAR]).plan([], 1, clock())[0]
    np.testing.assert_allclose(end(experience=known), FAR, atol=1e-6)


def test_a_goal_beyond_a_blocked_straight_line_is_reached_by_sampling():
    """The balls on both straight lines are forbidden for ever."""
    walls = [core.Constraint.ball((START + q) / 2, 0.15, 0, core.FOREVER) for q in (NEAR, FAR)]
    found = planner([NEAR, FAR]).plan(walls, 1, clock())[0]
    assert found is not None
    assert min(np.abs(found[-1] - q).max() for q in (NEAR, FAR)) < 1e-6


def composite(goals, seed=0):
    start = np.concatenate([START, RIGHT])
    return core.CompositeSearch(
        CELL.collision.core, start=start, goals=np.stack(goals), samples=LEVELS, edges=LEVELS, seed=seed
    )


@pytest.mark.parametrize("seed", range(5))
def test_a_composite_path_ends_at_one_of_the_goals(seed):
    goals = [np.concatenate([q, RIGHT]) for q in (FAR, NEAR, MIDDLE)]
    path = composite(goals, seed).grow(10_000, clock())
    assert min(np.abs(path[-1] - goal).max() for goal in goals) < 1e-6


def test_a_composite_path_avoids_goals_in_collision():
    crossed = np.concatenate([two_arms.reaching(0.0), two_arms.reaching(0.0)])
    free = np.concatenate([FAR, RIGHT])
    np.testing.assert_allclose(composite([crossed, free]).grow(10_000, clock())[-1], free, atol=1e-6)


def test_a_composite_start_at_any_goal_is_a_path():
    path = composite([np.concatenate([FAR, RIGHT]), np.concatenate([START, RIGHT])]).grow(1, clock())
    np.testing.assert_array_equal(path[0], path[1])


def replanned(goals, rows):
    return core.replan(
        CELL.collision.core,
        rows,
        [STEP, STEP],
        goals=goals,
        levels=LEVELS,
        attempts=20,
        seed=0,
        clock=clock(),
    )


def test_replanning_takes_the_arm_to_a_cheaper_goal():
    rows = [two_arms.along(0.08, START, FAR)]
    rows.append(np.repeat(RIGHT[None], len(rows[0]), axis=0))
    found, kept = replanned([GOALS, RIGHT[None]], rows)
    assert kept > 0
    np.testing.assert_allclose(found[0][-1], NEAR, atol=1e-6)
    assert replanned([FAR[None], RIGHT[None]], rows)[1] == 0


def test_replanning_keeps_out_of_a_goal_that_another_arm_blocks():
    here = two_arms.reaching(0.0)
    rows = [two_arms.along(0.08, START, FAR)]
    rows.append(np.repeat(here[None], len(rows[0]), axis=0))
    rows[0][:] = two_arms.reaching(1.2)
    found, _ = replanned([np.stack([here, two_arms.reaching(1.2)]), here[None]], rows)
    np.testing.assert_allclose(found[0][-1], two_arms.reaching(1.2), atol=1e-6)


def test_any_of_one_goal_gives_the_plan_of_the_goal():
    start, goal = {"left": START, "right": RIGHT}, {"left": NEAR, "right": RIGHT}
    one = make_problem(CELL, start, goal)
    any_of = make_problem(CELL, start, {**goal, "left": AnyOf((JointGoal(NEAR),))})
    np.testing.assert_array_equal(one.goals["left"], any_of.goals["left"])
    one_path, any_path = (planner(problem.goals["left"]).plan([], 1, clock())[0] for problem in (one, any_of))
    np.testing.assert_array_equal(one_path, any_path)
