"""RRT-Connect over all arms: its ways, and that it goes on where it stopped."""

from itertools import pairwise

import numpy as np
import pytest
import two_arms
from twins import clearance

from mmp_env import _core
from mmp_env.collision import HIT, KEEP_PROOF, PLAN_PROOF
from mmp_env.instances import draw_instance
from mmp_env.problem import make_problem
from mmp_env.rings import ring_cell

RANGE_RAD, STEP_RAD = 2.0, 0.05


def search_of(problem, seed=0, edge=RANGE_RAD):
    names, margin = problem.cell.arm_names, problem.margin
    start, goal = (np.concatenate([q[name] for name in names]) for q in (problem.start, problem.goal))
    levels = (HIT * margin, PLAN_PROOF * margin, KEEP_PROOF * margin)
    return _core.CompositeSearch(problem.cell.collision.core, start, goal, *levels, edge, STEP_RAD, seed)


def forever():
    return _core.Clock(np.inf)


def crowded(seed=3):
    cell = ring_cell(6)
    return make_problem(cell, *draw_instance(cell, seed=seed))


@pytest.mark.parametrize("kind", [two_arms.passing, two_arms.one_in_the_way, crowded])
def test_a_way_goes_from_start_to_goal_by_edges_no_longer_than_asked(kind):
    problem = kind()
    way = search_of(problem).grow(1_000_000, forever())
    names = problem.cell.arm_names
    np.testing.assert_array_equal(way[0], np.concatenate([problem.start[n] for n in names]).astype(np.float32))
    np.testing.assert_array_equal(way[-1], np.concatenate([problem.goal[n] for n in names]).astype(np.float32))
    assert np.linalg.norm(np.diff(way, axis=0), axis=1).max() <= RANGE_RAD * (1 + 1e-5)


def test_a_way_is_clear_between_its_samples_by_the_twin():
    problem = two_arms.passing()
    way = search_of(problem).grow(1_000_000, forever())
    fractions = np.linspace(0, 1, 60, endpoint=False)[:, None]
    dense = np.concatenate([a + fractions * (b - a) for a, b in pairwise(way)])
    for q in dense:
        between = clearance.moving_clearance(problem.cell, "left", q[:6], "right", q[6:])
        assert between >= KEEP_PROOF * problem.margin - 1e-5


def test_slices_find_what_one_go_finds():
    problem = crowded()
    once, sliced = search_of(problem), search_of(problem)
    way = once.grow(1_000_000, forever())
    found = None
    while found is None:
        found = sliced.grow(7, forever())
    np.testing.assert_array_equal(found, way)
    assert sliced.iterations == once.iterations
    assert sliced.nodes == once.nodes


def test_another_seed_finds_another_way():
    problem = crowded()
    ways = [search_of(problem, seed).grow(1_000_000, forever()) for seed in (0, 1)]
    assert ways[0].shape != ways[1].shape or (ways[0] != ways[1]).any()


def test_arms_that_are_at_their_goals_need_not_move():
    problem = two_arms.nothing_to_do()
    way = search_of(problem).grow(1, forever())
    assert way.shape == (2, 12)
    np.testing.assert_array_equal(way[0], way[1])


def test_no_iterations_and_no_time_find_nothing():
    assert search_of(crowded()).grow(0, forever()) is None
    clock = forever()
    clock.cancel()
    search = search_of(crowded())
    assert search.grow(1_000_000, clock) is None
    assert search.iterations < 100


def test_what_does_not_fit_the_cell_is_refused():
    problem = two_arms.passing()
    q = np.zeros(5)
    with pytest.raises(ValueError, match="number of joints"):
        _core.CompositeSearch(problem.cell.collision.core, q, q, 1e-3, 1e-3, 1e-3, RANGE_RAD, STEP_RAD, 0)
