"""Reference of constraints, safe intervals and departures, against values computed by hand for a toy arm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import intervals, toys

CELL = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]))
STRAIGHT = np.zeros(2)


def ball(begin, end, center=STRAIGHT, radius=0.2):
    return intervals.BallConstraint(center=np.asarray(center), radius=radius, begin=begin, end=end)


def clouds(begin, end, center, radius=0.1, margin=0.0, first_part=1):
    return intervals.CloudConstraint(
        centers=np.array([center], dtype=float),
        radii=np.array([radius]),
        margin=margin,
        first_part=first_part,
        begin=begin,
        end=end,
    )


def test_without_a_broken_constraint_all_of_time_is_safe():
    assert intervals.safe_intervals(CELL, "a", [0.5, 0], [ball(1, 2)]) == [(0.0, np.inf)]


def test_a_broken_constraint_cuts_its_time_out():
    assert intervals.safe_intervals(CELL, "a", STRAIGHT, [ball(1, 2)]) == [(0.0, 1), (2, np.inf)]


def test_the_ball_is_one_of_the_largest_joint_difference():
    assert not ball(0, 1).is_broken(CELL, "a", [0.21, 0])
    assert ball(0, 1).is_broken(CELL, "a", [0.2, -0.2])


def test_overlapping_times_are_merged_and_times_before_the_start_do_not_count():
    constraints = [ball(3, 4), ball(-2, -1), ball(1, 2), ball(1.5, 3), ball(-1, 0.5)]
    assert intervals.safe_intervals(CELL, "a", STRAIGHT, constraints) == [(0.5, 1), (4, np.inf)]


def test_a_constraint_without_end_leaves_no_last_interval():
    assert intervals.safe_intervals(CELL, "a", STRAIGHT, [ball(2, np.inf)]) == [(0.0, 2)]


def test_a_cloud_forbids_coming_closer_than_the_margin():
    # The tip is at (2, 0, 0) with radius 0.1: 0.3 m to the cloud's surface.
    assert not clouds(1, 2, [2.5, 0, 0], margin=0.29).is_broken(CELL, "a", STRAIGHT)
    assert clouds(1, 2, [2.5, 0, 0], margin=0.31).is_broken(CELL, "a", STRAIGHT)


def test_a_cloud_ignores_the_base_and_parts_before_the_first():
    assert not clouds(1, 2, [0, 0, 0]).is_broken(CELL, "a", STRAIGHT)
    assert clouds(1, 2, [1, 0, 0]).is_broken(CELL, "a", STRAIGHT)
    assert not clouds(1, 2, [1, 0, 0], first_part=2).is_broken(CELL, "a", STRAIGHT)


@given(
    windows=st.lists(st.tuples(st.floats(-3, 10), st.floats(0.01, 5)), max_size=6),
    times=st.lists(st.floats(0, 20), min_size=1, max_size=20),
)
def test_a_time_is_safe_exactly_where_no_window_holds_it(windows, times):
    constraints = [ball(begin, begin + length) for begin, length in windows]
    safe = intervals.safe_intervals(CELL, "a", STRAIGHT, constraints)
    for t in times:
        forbidden = any(begin <= t <= begin + length for begin, length in windows)
        edge = any(t in interval for interval in safe)
        assert any(lo < t < hi for lo, hi in safe) == (not forbidden and not edge)


def crossing_edge():
    """Returns an edge of the first joint through the ball about 0 with radius 0.2, inside for fractions 0.3 to 0.7."""
    return np.array([-0.5, 0]), np.array([0.5, 0])


def test_an_edge_may_be_left_before_or_after_it_would_meet_the_constraint():
    # Driven in 2 s, the ball is entered 0.6 s and left 1.4 s after departure.
    forbidden = intervals.forbidden_departures(CELL, "a", *crossing_edge(), 2.0, [ball(5, 6)])
    np.testing.assert_allclose(forbidden, [(5 - 1.4, 6 - 0.6)], atol=2 * 2.0 / 400)


@pytest.mark.parametrize(
    ("window", "expected"),
    [((0, 9), 0), ((3.5, 9), 3.5), ((4, 9), 5.4), ((6, 9), 6), ((4, 5), None), ((4, 5.5), 5.4)],
)
def test_the_earliest_departure_is_the_end_of_the_forbidden_time(window, expected):
    found = intervals.earliest_departure(CELL, "a", *crossing_edge(), 2.0, [ball(5, 6)], window)
    assert found == (None if expected is None else pytest.approx(expected, abs=0.01))


def test_an_instant_of_a_constraint_still_blocks_all_departures_that_meet_it():
    forbidden = intervals.forbidden_departures(CELL, "a", *crossing_edge(), 2.0, [ball(5, 5)])
    np.testing.assert_allclose(forbidden, [(5 - 1.4, 5 - 0.6)], atol=2 * 2.0 / 400)
