"""Planners that choose among candidates of each arm's goal."""

import numpy as np
import pytest
from support import two_arms

import mmp_planners
from mmp_env import JointGoal, check_plan, core, make_problem
from mmp_env.errors import InvalidInstanceError
from mmp_env.events import SolutionFound
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.files.writing import json_text
from mmp_env.model.goals import AnyOf
from mmp_planners.conflict_tree.constraints.named import KINDS, constraint_kind
from mmp_planners.conflict_tree.node import Node
from mmp_planners.goal_choice import ending_at, few, nearest
from mmp_planners.goal_combinations import MOST_COMBINATIONS, goal_combinations
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.shortcutting import retime_to_velocity_limits
from mmp_planners.registry import names

CELL = two_arms.facing_cell()
ELBOW_RAD = 0.9  # at which two arms that reach straight at each other overlap by 2 mm
HERE, AWAY = two_arms.reaching(0.0, ELBOW_RAD), two_arms.reaching(1.6, ELBOW_RAD)
START = {"left": two_arms.reaching(0.7, ELBOW_RAD), "right": two_arms.reaching(0.7, ELBOW_RAD)}


def any_of(*rows):
    return AnyOf(tuple(JointGoal(q) for q in rows))


def blocked_nearest():
    """Returns a problem in which the right arm's only goal blocks the nearest candidate of the left arm."""
    return make_problem(CELL, START, {"left": any_of(HERE, AWAY), "right": HERE})


def rivals():
    """Returns a problem in which the nearest candidates of both arms are not free together."""
    return make_problem(CELL, START, {"left": any_of(HERE, AWAY), "right": any_of(HERE, AWAY)})


@pytest.mark.parametrize("name", names())
def test_every_planner_takes_another_candidate_if_the_nearest_is_blocked(name):
    problem, events = blocked_nearest(), []
    result = mmp_planners.make(name).plan(problem, seed=0, time_limit=60, watch=events.append)
    plan = result.plan
    assert plan is not None, result.status
    assert check_plan(plan).valid
    np.testing.assert_array_equal(plan.positions["left"][-1], AWAY)
    np.testing.assert_array_equal(plan.problem.goal["left"], AWAY)
    np.testing.assert_array_equal(plan.problem.goal["right"], HERE)
    assert result.stats["cost_rad"] == pytest.approx(plan.cost_rad)
    assert result.stats["cost_lower_bound_rad"] == pytest.approx(problem.cost_lower_bound_rad)
    assert any(isinstance(event, SolutionFound) for event in events)


@pytest.mark.parametrize("name", names())
def test_every_planner_lets_one_of_two_rivals_go_elsewhere(name):
    plans = [mmp_planners.make(name).plan(rivals(), seed=3, time_limit=60).plan for _ in range(2)]
    assert check_plan(plans[0]).valid
    ends = [tuple(np.array_equal(plans[0].positions[arm][-1], q) for q in (HERE, AWAY)) for arm in CELL.arm_names]
    assert all(any(end) for end in ends)
    assert ends != [(True, False), (True, False)]
    assert json_text(plan_to_dict(plans[0])) == json_text(plan_to_dict(plans[1]))


def test_goals_of_which_no_combination_is_free_are_refused():
    with pytest.raises(InvalidInstanceError, match="cannot both be at their goals"):
        make_problem(CELL, START, {"left": any_of(HERE, HERE + 0.5 * np.eye(6)[5]), "right": HERE})


def context(problem):
    made = PlanningContext(problem, 0.1, SiRrtStar(), core.Clock(60.0))
    made.reseed(0)
    return made


def root(made):
    paths = tuple(made.low_level(arm, (), 0)[0] for arm in range(2))
    return Node(
        id=0,
        parent=None,
        paths=paths,
        constraints=((), ()),
        bounds=tuple(path.length for path in paths),
        conflicts=made.conflicts(paths, made.pairs()),
    )


@pytest.mark.parametrize("name", KINDS)
def test_constraints_of_a_conflict_that_never_ends_have_no_end(name):
    made = context(rivals())
    node = root(made)
    interval = node.first_conflict()
    assert interval.lasting
    for branch in constraint_kind(name, pad=0.25).branches(made, node.paths, interval, "begin"):
        assert max(constraint.end for constraint in branch.constraints) == core.FOREVER
        path, _ = made.low_level(branch.arm, branch.constraints, 1)
        assert path is not None
        np.testing.assert_array_equal(path.q[-1], AWAY)


def test_a_conflict_on_the_way_does_not_last():
    made = context(two_arms.passing())
    assert not root(made).first_conflict().lasting


def test_combinations_are_free_together_and_the_cheapest_comes_first():
    problem = rivals()
    rows = goal_combinations(problem, 0)
    np.testing.assert_array_equal(rows, goal_combinations(problem, 0))
    assert not (rows == np.concatenate([HERE, HERE])).all(axis=1).any()
    assert len(rows) == 3
    left, right = np.split(rows, 2, axis=1)
    assert (CELL.collision.pair_clearance("left", left, "right", right) > problem.margin).all()
    cost = np.abs(rows - np.concatenate([START["left"], START["right"]])).sum(axis=1)
    assert (np.diff(cost) >= 0).all()


def test_the_only_combination_is_the_goal_and_many_are_limited():
    problem = blocked_nearest()
    np.testing.assert_array_equal(goal_combinations(problem, 1), [np.concatenate([AWAY, HERE])])
    pans = [two_arms.reaching(pan, ELBOW_RAD) for pan in np.linspace(0.5, 1.6, 12)]
    many = make_problem(CELL, START, {"left": any_of(*pans), "right": any_of(*pans)})
    assert 2 < len(goal_combinations(many, 1)) <= MOST_COMBINATIONS


def test_few_candidates_are_the_nearest_and_some_of_the_others():
    rows = np.arange(100.0)[:, None]
    np.testing.assert_array_equal(few(rows, 200), rows)
    kept = few(rows, 8)[:, 0]
    assert len(kept) == 8
    np.testing.assert_array_equal(kept[:6], np.arange(6))
    assert kept[-1] == 99


def test_a_plan_chooses_the_candidates_where_it_ends():
    problem = rivals()
    ends = {"left": AWAY + 1e-7, "right": HERE - 1e-7}
    chosen = ending_at(problem, {name: q[None] for name, q in ends.items()})
    np.testing.assert_array_equal(nearest(problem.goals["left"], ends["left"]), AWAY)
    np.testing.assert_array_equal(chosen.goal["right"], HERE)
    assert chosen.cost_lower_bound_rad == problem.cost_lower_bound_rad


def test_lns_moves_an_arm_to_a_cheaper_candidate():
    problem = make_problem(
        CELL, START, {"left": any_of(two_arms.reaching(0.9, ELBOW_RAD), AWAY), "right": two_arms.reaching(1.0)}
    )
    rows = two_arms.along(0.08, START["left"], AWAY)
    right = np.linspace(START["right"], problem.goal["right"], len(rows))
    far = retime_to_velocity_limits(problem, [rows, right])
    np.testing.assert_array_equal(far.problem.goal["left"], AWAY)
    found, kept = LargeNeighbourhoodSearch(attempts=20)(far, 0, core.Clock(60.0))
    assert kept > 0
    np.testing.assert_array_equal(found.problem.goal["left"], two_arms.reaching(0.9, ELBOW_RAD))
    assert check_plan(found).valid
