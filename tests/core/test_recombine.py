"""Ways put together anew: the shortest that can be timed, proved clear, and none where arms shut each other in."""

import itertools

import numpy as np
import pytest
from reference import clearance, coordination
from support import two_arms
from support.recombinations import DT_S, NO_END, lifted, recombination, run, shut_in, straight, with_a_twist

from mmp_env import check_plan, core, draw_instance, ring_cell
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.problem import make_problem
from mmp_planners.portfolio.shortcutting import on_grid, retime_to_velocity_limits
from mmp_planners.rrt_connect import RrtConnect


def of_arm(rows):
    return np.abs(np.diff(rows, axis=0)).sum()


def length(rows):
    return sum(of_arm(q) for q in rows)


def assert_driven(problem, found, *ways):
    """Exact at the ends, no faster than allowed, each arm on one of its paths, and clear of the other."""
    assert len({len(rows) for rows in found}) == 1
    for k, name in enumerate(problem.cell.arm_names):
        given = [way[k] for way in ways]
        np.testing.assert_array_equal(found[k][[0, -1]], given[0][[0, -1]].astype(np.float32))
        assert (np.abs(np.diff(found[k], axis=0)) <= problem.max_velocity[name] * DT_S * (1 + 1e-4)).all()
        assert any(np.abs(found[k][:, None] - rows).max(axis=-1).min(axis=-1).max() < 1e-5 for rows in given)
    for (a, rows_a), (b, rows_b) in itertools.combinations(zip(problem.cell.arm_names, found, strict=True), 2):
        gap = clearance.clearance_of_motions(problem.cell, a, rows_a, b, rows_b)
        assert gap >= problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR).proof - 1e-5


def test_one_arm_waits_where_the_hands_would_meet():
    problem = two_arms.passing()
    ways = straight(problem)
    assert clearance.clearance_of_motions(problem.cell, "left", ways[0], "right", ways[1]) < 0
    found = run(recombination(problem, ways))
    assert_driven(problem, found, ways)
    assert length(found) == pytest.approx(problem.cost_lower_bound_rad, abs=1e-5)
    assert len(ways[0]) < len(found[0]) < len(ways[0]) + len(ways[1])


def test_arms_that_are_not_in_the_way_go_at_once():
    problem = two_arms.turning((1.5, 1.1), (1.0, 1.3))
    ways = straight(problem)
    assert len(run(recombination(problem, ways))[0]) == max(len(rows) for rows in ways)


def test_an_arm_that_need_not_move_has_a_way_of_one_row():
    problem = two_arms.one_moves()
    ways = [straight(problem)[0], problem.start["right"][None]]
    assert_driven(problem, run(recombination(problem, ways)), ways)


def test_arms_that_shut_each_other_in_have_no_motion():
    problem = shut_in()
    ways = straight(problem)
    gaps = coordination.gaps_of_ways(problem.cell, "left", ways[0], "right", ways[1], 4)
    assert min(gaps[0, 0], gaps[-1, -1]) > 0.1
    assert not coordination.both_can_arrive(gaps, 4, 0.0)
    assert run(recombination(problem, ways)) is None


def test_the_shortest_way_out_is_taken():
    problem = shut_in()
    ways = [lifted(problem, 1.2), straight(problem), lifted(problem), lifted(problem, 1.1)]
    for order in itertools.permutations(ways):
        found = run(recombination(problem, *order))
        assert_driven(problem, found, *ways)
        assert length(found) == pytest.approx(length(lifted(problem)), abs=1e-5)


def test_what_is_found_is_shorter_than_the_limit():
    problem = shut_in()
    ways = recombination(problem, straight(problem), lifted(problem))
    shortest = length(lifted(problem))
    assert run(ways, shortest - 1e-4) is None
    assert length(run(ways, shortest + 1e-4)) == pytest.approx(shortest, abs=1e-5)


def test_without_ways_or_time_nothing_is_found():
    problem = two_arms.passing()
    assert run(recombination(problem)) is None
    cancelled = core.Clock(NO_END)
    cancelled.cancel()
    ways = recombination(problem, straight(problem))
    assert ways.recombine(NO_END, cancelled) is None
    assert run(ways) is not None


def test_the_same_ways_are_put_together_in_the_same_way():
    problem = shut_in()
    ways = [straight(problem), lifted(problem, 1.1), lifted(problem)]
    for a, b in zip(*(run(recombination(problem, *ways)) for _ in range(2)), strict=True):
        np.testing.assert_array_equal(a, b)


def test_no_choice_is_given_twice():
    problem = shut_in()
    ways = recombination(problem, straight(problem), lifted(problem, 1.1), lifted(problem))
    for height in (1.0, 1.1):
        assert length(run(ways)) == pytest.approx(length(lifted(problem, height)), abs=1e-5)
    assert run(ways) is None
    ways.add(lifted(problem, 1.2))
    assert length(run(ways)) == pytest.approx(length(lifted(problem, 1.2)), abs=1e-5)
    assert run(ways) is None


def test_it_does_not_matter_how_slowly_the_ways_were_driven():
    problem = shut_in()
    fast = lifted(problem)
    slow = []
    for rows in fast:
        halves = np.vstack([rows[:1], *([(a + b) / 2, b] for a, b in itertools.pairwise(rows))])
        slow.append(np.repeat(halves, 2 + np.arange(len(halves)) % 3, axis=0))
    found, expected = run(recombination(problem, slow)), run(recombination(problem, fast))
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_corners_are_not_cut_where_the_steps_are_short():
    problem = two_arms.one_moves()
    start, goal = problem.start["left"], problem.goal["left"]
    zigzag = start + np.linspace(0, 1, 17)[:, None] * (goal - start)
    zigzag[1::2, 3] += 0.02
    ways = [zigzag, problem.start["right"][None]]
    found = run(recombination(problem, ways))
    assert length(found) == pytest.approx(length(ways), abs=1e-5)
    assert_driven(problem, found, ways)


def test_of_too_many_ways_the_shortest_are_kept():
    problem = shut_in()
    useless = [with_a_twist(problem, 0.01 * k) for k in range(32)]
    way_out = lifted(problem)
    assert max(length(way) for way in useless) < length(way_out)
    assert length(run(recombination(problem, *useless[:31], way_out))) == pytest.approx(length(way_out), abs=1e-5)
    assert run(recombination(problem, *useless, way_out)) is None
    assert run(recombination(problem, way_out, *useless)) is None


def test_a_way_in_the_place_of_a_longer_one_is_looked_at_anew():
    problem = shut_in()
    longest, way_out = with_a_twist(problem, 1.6), lifted(problem)
    assert length(way_out) < length(longest)
    ways = recombination(problem, *(with_a_twist(problem, 0.01 * k) for k in range(31)), longest)
    assert run(ways) is None
    ways.add(way_out)
    assert length(run(ways)) == pytest.approx(length(way_out), abs=1e-5)


@pytest.mark.parametrize(("arms", "seed"), [(4, 0), (6, 3)])
def test_of_many_arms_every_choice_is_thought_of(arms, seed):
    cell = ring_cell(arms, "panda")
    problem = make_problem(cell, *draw_instance(cell, seed=seed))
    plans = [RrtConnect(shorten=100).plan(problem, seed=s).plan for s in range(2)]
    ways = [on_grid(plan, DT_S) for plan in plans]
    found = run(recombination(problem, *ways))
    assert_driven(problem, found, *ways)
    assert check_plan(retime_to_velocity_limits(problem, found)).valid
    assert length(found) < min(length(way) for way in ways) - 1e-3
    choices = [list(choice) for choice in itertools.product(*zip(*ways, strict=True))]
    possible = [length(choice) for choice in choices if run(recombination(problem, choice)) is not None]
    assert length(found) == pytest.approx(min(possible), abs=1e-4)
    assert len(possible) < len(choices)


def test_ways_that_do_not_fit_the_cell_are_refused():
    problem = two_arms.one_moves()
    left, right = straight(two_arms.passing())
    ways = recombination(problem)
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
            ways.add(bad)
    with pytest.raises(TypeError):
        ways.add([left[0], right[0]])
    assert run(ways) is None


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
