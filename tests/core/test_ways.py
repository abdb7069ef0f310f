"""What is known of the ways that are put together: their numbers, the shortest, and who shuts whom in."""

import numpy as np
import pytest
from support import two_arms
from support.recombinations import DT_S, NO_END, lifted, recombination, run, shut_in, straight, with_a_twist

from mmp_env import core


def closed(ways, choice):
    return ways.infeasible_pairs(choice, core.Clock(NO_END))


def test_ways_have_numbers_and_equal_ones_the_same():
    problem = shut_in()
    ways = recombination(problem)
    first, second, again = ways.add(straight(problem)), ways.add(lifted(problem)), ways.add(straight(problem))
    assert first == again
    assert second[0] not in first
    assert second[1] == first[1], "the right arm goes the same way"
    assert ways.shortest() == first
    for numbers, given in ((first, straight(problem)), (second, lifted(problem))):
        for arm in (0, 1):
            np.testing.assert_allclose(ways.path(arm, numbers[arm]), given[arm], atol=1e-5)


def test_a_way_is_given_back_at_full_speed_without_waiting():
    problem = two_arms.passing()
    speeds = [problem.max_velocity[name] * DT_S for name in problem.cell.arm_names]
    slow = [np.repeat(q[:1] + np.linspace(0, 1, 200)[:, None] * (q[-1] - q[0]), 2, axis=0) for q in straight(problem)]
    ways = recombination(problem)
    for arm, number in enumerate(ways.add(slow)):
        way = ways.path(arm, number)
        np.testing.assert_allclose(way[[0, -1]], slow[arm][[0, -1]], atol=1e-6)
        steps = np.abs(np.diff(way, axis=0))
        assert (steps <= speeds[arm] * (1 + 1e-4)).all()
        assert len(steps) <= np.abs(way[-1] - way[0]).max() / speeds[arm].max() * 1.2 + 1


def test_arms_that_shut_each_other_in_are_named_until_one_has_another_way():
    problem = shut_in()
    ways = recombination(problem)
    first, way_out = ways.add(straight(problem)), ways.add(lifted(problem))
    assert closed(ways, first) == [(0, 1)]
    assert closed(ways, way_out) == []
    assert closed(ways, [way_out[0], first[1]]) == []


def test_who_waits_shuts_nobody_in():
    problem = two_arms.passing()
    ways = recombination(problem)
    assert closed(ways, ways.add(straight(problem))) == []


def test_a_way_that_had_to_go_is_no_longer_there():
    problem = shut_in()
    ways = recombination(problem)
    longest = ways.add(lifted(problem))
    assert ways.has(longest)
    kept = [ways.add(with_a_twist(problem, 0.01 * k)) for k in range(32)]
    assert not ways.has(longest)
    assert all(ways.has(numbers) for numbers in kept)
    assert ways.add(lifted(problem))[0] == -1
    for ask in (lambda: ways.path(0, longest[0]), lambda: closed(ways, longest)):
        with pytest.raises(ValueError, match=r"no such path|one path per arm"):
            ask()


def test_without_ways_there_is_no_shortest():
    ways = recombination(shut_in())
    assert ways.shortest() == [-1, -1]
    assert not ways.has(ways.shortest())
    assert run(ways) is None


def test_choices_that_do_not_fit_the_cell_are_refused():
    problem = two_arms.passing()
    ways = recombination(problem)
    numbers = ways.add(straight(problem))
    for choice in ([], numbers[:1], [*numbers, numbers[0]], [numbers[0], -1], numbers[::-1]):
        assert not ways.has(choice)
        with pytest.raises(ValueError, match="one path per arm"):
            closed(ways, choice)
    for arm in (-1, 2):
        with pytest.raises(ValueError, match="no such arm"):
            ways.path(arm, numbers[0])
