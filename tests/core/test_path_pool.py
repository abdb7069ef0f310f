"""The path pool: path ids, the shortest paths, and infeasible pairs."""

import numpy as np
import pytest
from support import two_arms
from support.path_pools import DT_S, NO_END, lifted, mutually_blocking, path_pool, run, straight, with_a_twist
from support.two_arms import along

from mmp_env import core


def infeasible(pool, choice):
    return pool.infeasible_pairs(choice, core.Clock(NO_END))


def test_paths_have_ids_and_equal_paths_the_same_id():
    problem = mutually_blocking()
    pool = path_pool(problem)
    first, second, again = pool.add(straight(problem)), pool.add(lifted(problem)), pool.add(straight(problem))
    assert first == again
    assert second[0] not in first
    assert second[1] == first[1], "the right arm has the same path"
    assert pool.shortest() == first
    for numbers, given in ((first, straight(problem)), (second, lifted(problem))):
        for arm in (0, 1):
            np.testing.assert_allclose(pool.path(arm, numbers[arm]), given[arm], atol=1e-5)


def test_monotone_paths_between_the_same_ends_are_one_path_only_where_they_run_alike():
    """They all have the same length."""
    problem = two_arms.turning((1.5, 0.5), (1.0, 1.0))
    start = problem.start["left"]
    goal = problem.goal["left"] + np.array([0.0, 0.0, -0.9, 0.0, 0.0, 0.0])
    step, right = problem.max_velocity["left"][0] * DT_S, problem.start["right"][None]
    corners = [np.where(np.arange(6) == first, goal, start) for first in (0, 2)]
    pool = path_pool(problem)
    (first, _), (second, _) = (pool.add([along(step, start, corner, goal), right]) for corner in corners)
    assert first != second
    for number, corner in zip((first, second), corners, strict=True):
        np.testing.assert_allclose(pool.path(0, number), along(step, start, corner, goal), atol=1e-5)
        slow = along(step / 3, start, corner, goal)
        assert pool.add([slow, right])[0] == number, "however it is sampled"
    near = along(step, start, corners[0] + 0.1 * (goal - corners[0]), goal)
    assert pool.add([near, right])[0] == first, "nearly the same path adds nothing"


def test_a_path_is_returned_at_full_speed_without_waiting():
    problem = two_arms.passing()
    speeds = [problem.max_velocity[name] * DT_S for name in problem.cell.arm_names]
    slow = [np.repeat(q[:1] + np.linspace(0, 1, 200)[:, None] * (q[-1] - q[0]), 2, axis=0) for q in straight(problem)]
    pool = path_pool(problem)
    for arm, number in enumerate(pool.add(slow)):
        path = pool.path(arm, number)
        np.testing.assert_allclose(path[[0, -1]], slow[arm][[0, -1]], atol=1e-6)
        steps = np.abs(np.diff(path, axis=0))
        assert (steps <= speeds[arm] * (1 + 1e-4)).all()
        assert len(steps) <= np.abs(path[-1] - path[0]).max() / speeds[arm].max() * 1.2 + 1


def test_mutually_blocking_pairs_are_infeasible_until_one_arm_has_another_path():
    problem = mutually_blocking()
    pool = path_pool(problem)
    first, free_paths = pool.add(straight(problem)), pool.add(lifted(problem))
    assert infeasible(pool, first) == [(0, 1)]
    assert infeasible(pool, free_paths) == []
    assert infeasible(pool, [free_paths[0], first[1]]) == []


def test_a_pair_that_can_wait_is_feasible():
    problem = two_arms.passing()
    pool = path_pool(problem)
    assert infeasible(pool, pool.add(straight(problem))) == []


def test_an_evicted_path_is_unknown():
    problem = mutually_blocking()
    pool = path_pool(problem)
    longest = pool.add(lifted(problem))
    assert pool.has(longest)
    kept = [pool.add(with_a_twist(problem, 0.01 * k)) for k in range(32)]
    assert not pool.has(longest)
    assert all(pool.has(numbers) for numbers in kept)
    assert pool.add(lifted(problem))[0] == -1
    for ask in (lambda: pool.path(0, longest[0]), lambda: infeasible(pool, longest)):
        with pytest.raises(ValueError, match=r"no such path|one path per arm"):
            ask()


def test_a_pool_without_paths_has_no_shortest():
    pool = path_pool(mutually_blocking())
    assert pool.shortest() == [-1, -1]
    assert not pool.has(pool.shortest())
    assert run(pool) is None


def test_combinations_that_do_not_fit_the_cell_are_refused():
    problem = two_arms.passing()
    pool = path_pool(problem)
    numbers = pool.add(straight(problem))
    for choice in ([], numbers[:1], [*numbers, numbers[0]], [numbers[0], -1], numbers[::-1]):
        assert not pool.has(choice)
        with pytest.raises(ValueError, match="one path per arm"):
            infeasible(pool, choice)
    for arm in (-1, 2):
        with pytest.raises(ValueError, match="no such arm"):
            pool.path(arm, numbers[0])
