"""Path recombination: the shortest feasible combination, proved clear, and none where arms block each other."""

import itertools

import numpy as np
import pytest
from reference import clearance, coordination
from support import two_arms
from support.path_pools import DT_S, NO_END, lifted, mutually_blocking, path_pool, run, straight, with_a_twist

from mmp_env import check_plan, core, draw_instance, ring_cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.problems.making import make_problem
from mmp_planners.portfolio.shortcutting import on_grid, retime_to_velocity_limits
from mmp_planners.rrt_connect import RrtConnect


def of_arm(rows):
    return np.abs(np.diff(rows, axis=0)).sum()


def length(rows):
    return sum(of_arm(q) for q in rows)


def assert_driven(problem, found, *paths):
    """Checks exact ends, velocity limits, that each arm is on one of its paths, and clearance."""
    assert len({len(rows) for rows in found}) == 1
    for k, name in enumerate(problem.cell.arm_names):
        given = [path[k] for path in paths]
        np.testing.assert_array_equal(found[k][[0, -1]], given[0][[0, -1]].astype(np.float32))
        assert (np.abs(np.diff(found[k], axis=0)) <= problem.max_velocity[name] * DT_S * (1 + 1e-4)).all()
        assert any(np.abs(found[k][:, None] - rows).max(axis=-1).min(axis=-1).max() < 1e-5 for rows in given)
    for (a, rows_a), (b, rows_b) in itertools.combinations(zip(problem.cell.arm_names, found, strict=True), 2):
        gap = clearance.clearance_of_motions(problem.cell, a, rows_a, b, rows_b)
        assert gap >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - 1e-5


def test_one_arm_waits_where_the_hands_would_meet():
    problem = two_arms.passing()
    paths = straight(problem)
    assert clearance.clearance_of_motions(problem.cell, "left", paths[0], "right", paths[1]) < 0
    found = run(path_pool(problem, paths))
    assert_driven(problem, found, paths)
    assert length(found) == pytest.approx(problem.cost_lower_bound_rad, abs=1e-5)
    assert len(paths[0]) < len(found[0]) < len(paths[0]) + len(paths[1])


def test_arms_without_conflict_start_at_once():
    problem = two_arms.turning((1.5, 1.1), (1.0, 1.3))
    paths = straight(problem)
    assert len(run(path_pool(problem, paths))[0]) == max(len(rows) for rows in paths)


def test_an_arm_that_need_not_move_has_a_path_of_one_row():
    problem = two_arms.one_moves()
    paths = [straight(problem)[0], problem.start["right"][None]]
    assert_driven(problem, run(path_pool(problem, paths)), paths)


def test_mutually_blocking_arms_have_no_motion():
    problem = mutually_blocking()
    paths = straight(problem)
    gaps = coordination.gaps_of_paths(problem.cell, "left", paths[0], "right", paths[1], 4)
    assert min(gaps[0, 0], gaps[-1, -1]) > 0.1
    assert not coordination.both_can_arrive(gaps, 4, 0.0)
    assert run(path_pool(problem, paths)) is None


def test_the_shortest_feasible_combination_is_chosen():
    problem = mutually_blocking()
    paths = [lifted(problem, 1.2), straight(problem), lifted(problem), lifted(problem, 1.1)]
    for order in itertools.permutations(paths):
        found = run(path_pool(problem, *order))
        assert_driven(problem, found, *paths)
        assert length(found) == pytest.approx(length(lifted(problem)), abs=1e-5)


def test_a_found_combination_is_shorter_than_the_limit():
    problem = mutually_blocking()
    paths = path_pool(problem, straight(problem), lifted(problem))
    shortest = length(lifted(problem))
    assert run(paths, shortest - 1e-4) is None
    assert length(run(paths, shortest + 1e-4)) == pytest.approx(shortest, abs=1e-5)


def test_without_paths_or_time_nothing_is_found():
    problem = two_arms.passing()
    assert run(path_pool(problem)) is None
    cancelled = core.Clock(NO_END)
    cancelled.cancel()
    paths = path_pool(problem, straight(problem))
    assert paths.recombine(NO_END, cancelled) is None
    assert run(paths) is not None


def test_the_same_paths_give_the_same_motions():
    problem = mutually_blocking()
    paths = [straight(problem), lifted(problem, 1.1), lifted(problem)]
    for a, b in zip(*(run(path_pool(problem, *paths)) for _ in range(2)), strict=True):
        np.testing.assert_array_equal(a, b)


def test_no_combination_is_returned_twice():
    problem = mutually_blocking()
    paths = path_pool(problem, straight(problem), lifted(problem, 1.1), lifted(problem))
    for height in (1.0, 1.1):
        assert length(run(paths)) == pytest.approx(length(lifted(problem, height)), abs=1e-5)
    assert run(paths) is None
    paths.add(lifted(problem, 1.2))
    assert length(run(paths)) == pytest.approx(length(lifted(problem, 1.2)), abs=1e-5)
    assert run(paths) is None


def test_the_speed_of_the_given_paths_does_not_matter():
    problem = mutually_blocking()
    fast = lifted(problem)
    slow = []
    for rows in fast:
        halves = np.vstack([rows[:1], *([(a + b) / 2, b] for a, b in itertools.pairwise(rows))])
        slow.append(np.repeat(halves, 2 + np.arange(len(halves)) % 3, axis=0))
    found, expected = run(path_pool(problem, slow)), run(path_pool(problem, fast))
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_corners_are_not_cut_where_the_steps_are_short():
    problem = two_arms.one_moves()
    start, goal = problem.start["left"], problem.goal["left"]
    zigzag = start + np.linspace(0, 1, 17)[:, None] * (goal - start)
    zigzag[1::2, 3] += 0.02
    paths = [zigzag, problem.start["right"][None]]
    found = run(path_pool(problem, paths))
    assert length(found) == pytest.approx(length(paths), abs=1e-5)
    assert_driven(problem, found, paths)


def test_a_full_pool_keeps_the_shortest_paths():
    problem = mutually_blocking()
    useless = [with_a_twist(problem, 0.01 * k) for k in range(32)]
    free_paths = lifted(problem)
    assert max(length(path) for path in useless) < length(free_paths)
    assert length(run(path_pool(problem, *useless[:31], free_paths))) == pytest.approx(length(free_paths), abs=1e-5)
    assert run(path_pool(problem, *useless, free_paths)) is None
    assert run(path_pool(problem, free_paths, *useless)) is None


def test_a_path_that_replaces_a_longer_one_is_tried():
    problem = mutually_blocking()
    longest, free_paths = with_a_twist(problem, 1.6), lifted(problem)
    assert length(free_paths) < length(longest)
    paths = path_pool(problem, *(with_a_twist(problem, 0.01 * k) for k in range(31)), longest)
    assert run(paths) is None
    paths.add(free_paths)
    assert length(run(paths)) == pytest.approx(length(free_paths), abs=1e-5)


@pytest.mark.parametrize(("arms", "seed"), [(4, 7), (6, 5)])
def test_every_combination_of_many_arms_is_considered(arms, seed):
    cell = ring_cell(arms, "panda")
    problem = make_problem(cell, *draw_instance(cell, seed=seed))
    plans = [RrtConnect(shorten=100).plan(problem, seed=s).plan for s in range(2)]
    paths = [on_grid(plan, DT_S) for plan in plans]
    found = run(path_pool(problem, *paths))
    assert_driven(problem, found, *paths)
    assert check_plan(retime_to_velocity_limits(problem, found)).valid
    assert length(found) < min(length(path) for path in paths) - 1e-3
    choices = [list(choice) for choice in itertools.product(*zip(*paths, strict=True))]
    possible = [length(choice) for choice in choices if run(path_pool(problem, choice)) is not None]
    assert length(found) == pytest.approx(min(possible), abs=1e-4)
    assert len(possible) < len(choices)


def test_paths_that_do_not_fit_the_cell_are_refused():
    problem = two_arms.one_moves()
    left, right = straight(two_arms.passing())
    paths = path_pool(problem)
    for bad, words in (
        ([], "one array per arm"),
        ([left], "one array per arm"),
        ([left, right, right], "one array per arm"),
        ([left, right[:, :5]], "wrong number of joints"),
        ([left, right[:0]], "a path needs one row"),
        ([left, np.full((3, 6), np.nan)], "must be finite"),
        ([np.full((3, 6), np.inf), right], "must be finite"),
    ):
        with pytest.raises(ValueError, match=words):
            paths.add(bad)
    with pytest.raises(TypeError):
        paths.add([left[0], right[0]])
    assert run(paths) is None


def test_steps_that_do_not_fit_the_cell_are_refused():
    compiled, steps = two_arms.passing().cell.collision.core, np.full(6, 0.08)
    for bad, words in (
        ([], "one array per arm"),
        ([steps], "one array per arm"),
        ([steps, steps[:5]], "wrong number of joints"),
        ([steps, 0 * steps], "steps must be from 1e-5 to 1e4 rad"),
        ([steps, -steps], "steps must be from 1e-5 to 1e4 rad"),
        ([np.nan * steps, steps], "steps must be from 1e-5 to 1e4 rad"),
    ):
        with pytest.raises(ValueError, match=words):
            core.PathRecombination(compiled, bad, core.Levels(0.002, 0.0012))
