"""Single-arm paths for the conflict tree, through `PlanningContext.low_level`."""

import math

import numpy as np
import pytest
from reference import toys
from support import two_arms

from mmp_env import core
from mmp_env.gym.instances import draw_instance
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners import make
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext

DT_S = 0.1


def context(problem, seed=0, **options):
    made = PlanningContext(problem, DT_S, SiRrtStar(**options), core.Clock(math.inf))
    made.reseed(seed)
    return made


def ring(robot, seed):
    cell = ring_cell(4, robot)
    return make_problem(cell, *draw_instance(cell, seed=seed))


def assert_sound(there, arm, path):
    """Checks start, goal, speed, limits, and clearance from static bodies at every instant."""
    problem, name = there.problem, there.names[arm]
    np.testing.assert_array_equal(path.q[[0, -1]], [problem.start[name], problem.goal[name]])
    # The search uses single precision. Steps that are too fast by rounding are stretched in the plan.
    assert (np.abs(np.diff(path.q, axis=0)) <= there.max_step[arm] * (1 + 2e-4)).all()
    assert problem.cell.collision.edge_free(name, path.q[:-1], path.q[1:], margin=problem.margin).all()
    assert path.length >= np.abs(problem.goal[name] - problem.start[name]).sum() - 1e-9


@pytest.mark.parametrize("robot", ["ur5e", "panda", "piper"])
def test_a_path_keeps_what_an_arm_alone_must_keep(robot):
    there = context(ring(robot, 5))
    for arm in range(4):
        path, _ = there.low_level(arm, (), 7)
        assert path is not None
        assert_sound(there, arm, path)


def test_a_free_straight_line_is_returned_at_full_speed_without_search():
    there = context(two_arms.passing())
    path, iterations = there.low_level(0, (), 0)
    assert iterations == 0
    assert path.length == pytest.approx(1.6)
    assert path.last == pytest.approx(1.6 / 0.8 / DT_S, abs=2)


def test_without_direct_connections_also_a_free_line_is_searched_for():
    path, iterations = context(two_arms.passing(), direct=False).low_level(0, (), 0)
    assert iterations > 0
    assert path is not None


def test_the_search_goes_on_after_the_first_path_for_the_given_iterations():
    first, improved = (context(ring("ur5e", 5), direct=False, improve=n).low_level(1, (), 7) for n in (0, 200))
    assert first[1] < 200 <= improved[1]
    assert improved[0].last <= first[0].last


def test_a_planner_improves_each_path_for_all_the_iterations_that_it_is_given():
    counted = []
    for n in (0, 7, 200):
        planner = make("ecbs", direct=False, improve=n)
        there = PlanningContext(ring("ur5e", 5), DT_S, planner.low_level(), core.Clock(math.inf))
        there.reseed(0)
        counted.append(there.low_level(1, (), 7)[1])
    first = counted[0]
    assert first > 0
    assert counted == [first, first + 7, first + 200]


def test_without_a_static_tree_no_call_uses_one():
    def found(**options):
        there = context(ring("ur5e", 5), **options)
        return [there.low_level(arm, (), seed) for arm in range(4) for seed in range(3)]

    # The branch of the static tree needs no iterations; without the tree only a straight line does not.
    assert [n for path, n in found(direct=False, static_tree=False) if path is None or n == 0] == []
    with_tree, without = found(), found(static_tree=False)
    assert max(n for _, n in with_tree) == 0 < max(n for _, n in without)


def length_in_tree(q, parents, k):
    return 0.0 if parents[k] < 0 else length_in_tree(q, parents, parents[k]) + np.abs(q[k] - q[parents[k]]).sum()


@pytest.mark.parametrize("seed", range(5))
def test_of_two_paths_to_a_sample_that_arrive_at_once_the_tree_keeps_the_shorter(seed):
    there, count = context(two_arms.passing(), seed), 0
    for iterations in range(5, 151):
        q, links, _ = core.search_tree(there._single[0], others=[], seed=seed, clock=there.clock, iterations=iterations)
        if len(q) == count:
            continue
        count, last = len(q), len(q) - 1  # the paths to the latest sample are those that the tree chose from
        arrivals, parents = links.T
        moves = np.abs(q[:last] - q[last])
        for k in np.argsort(np.linalg.norm(q[:last] - q[last], axis=1))[:5]:
            steps = np.ceil((moves[k] / there.max_step[0]).max() - 1e-4)
            if moves[k].max() <= core.STEERING_RAD and arrivals[k] + steps == arrivals[last]:
                assert length_in_tree(q, parents, last) <= length_in_tree(q, parents, k) + moves[k].sum() + 1e-3


def test_without_shortcuts_the_paths_are_those_of_the_search():
    def found(**options):
        there = context(ring("ur5e", 5), direct=False, **options)
        return [there.low_level(arm, (), seed) for arm in range(4) for seed in range(5)]

    shortened, searched = found(), found(shortcuts=0)
    assert [iterations for _, iterations in searched] == [iterations for _, iterations in shortened]
    lengths = [(one.length, other.length) for (one, _), (other, _) in zip(searched, shortened, strict=True)]
    assert all(one >= other for one, other in lengths)
    assert any(one > other for one, other in lengths)


def test_a_slower_arm_takes_more_steps():
    fast = two_arms.passing()
    slow = make_problem(
        fast.cell, fast.start, fast.goal, max_velocity={"left": np.full(6, 0.2), "right": np.full(6, 0.8)}
    )
    there = context(slow)
    paths = [there.low_level(k, (), 0)[0] for k in (0, 1)]
    assert paths[0].last == pytest.approx(1.6 / 0.2 / DT_S, abs=3)
    assert paths[1].last == pytest.approx(1.6 / 0.8 / DT_S, abs=3)


def detour(there, seed):
    """Returns a path around a ball that always blocks the straight line."""
    start, goal = there.problem.start["left"], there.problem.goal["left"]
    return there.low_level(0, [core.Constraint.ball((start + goal) / 2, 0.2, 0, core.FOREVER)], seed)


def test_the_same_seed_finds_the_same_path_in_the_same_iterations():
    (first, n), (again, m) = (detour(context(two_arms.passing()), 1) for _ in range(2))
    np.testing.assert_array_equal(first.q, again.q)
    assert n == m > 0
    other, _ = detour(context(two_arms.passing()), 2)
    assert other.q.shape != first.q.shape or not np.array_equal(other.q, first.q)


def test_earlier_calls_change_no_path():
    fresh, used = context(two_arms.passing()), context(two_arms.passing())
    for seed in range(5):
        detour(used, seed)
    used.low_level(1, (), 3)
    np.testing.assert_array_equal(detour(used, 9)[0].q, detour(fresh, 9)[0].q)


def test_a_goal_that_is_blocked_for_ever_has_no_path_and_one_that_is_blocked_for_a_while_is_waited_for():
    there = context(two_arms.passing(), iterations=50)
    goal = there.problem.goal["left"]
    for end, found in ((core.FOREVER, False), (60, True)):
        path, _ = there.low_level(0, [core.Constraint.ball(goal, 0.1, 5, end)], 0)
        assert (path is not None) == found
    assert_sound(there, 0, path)
    assert path.last >= 60


def test_an_arm_at_its_goal_moves_aside_and_returns():
    """A constraint forbids the goal for some time, so staying there is no solution."""
    there = context(two_arms.nothing_to_do())
    ball = core.Constraint.ball(there.problem.goal["left"], 0.2, 10, 40)
    path, _ = there.low_level(0, [ball], 0)
    assert path is not None
    assert_sound(there, 0, path)
    assert path.length > 0.4
    assert not core.breaks_constraint(there.core, path.motion, [ball], there.problem.margin)
    assert there.low_level(0, (), 0)[0].last == 0


def test_a_start_that_is_forbidden_at_once_has_no_path():
    there = context(two_arms.passing(), iterations=50)
    start = there.problem.start["left"]
    assert there.low_level(0, [core.Constraint.ball(start, 0.3, 0, 20)], 0)[0] is None


def test_a_larger_budget_searches_longer():
    """A toy arm whose elbow hardly moves has one path only, and it is always blocked."""
    limits = {"lower": np.array([-np.pi, -1e-3]), "upper": np.array([np.pi, 1e-3])}
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0], **limits))
    there = context(make_problem(cell, {"a": [-1.0, 0.0]}, {"a": [1.0, 0.0]}), iterations=10)
    closed = core.Constraint.ball(np.zeros(2), 0.3, 0, core.FOREVER)
    found = [there.low_level(0, [closed], 0, budget) for budget in (1.0, 2.0, 4.0)]
    assert found == [(None, 10), (None, 20), (None, 40)]
