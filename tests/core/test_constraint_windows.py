"""Time windows of constraints: open windows, fractions of steps, and single instants. Times are in steps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import toys, windows

from mmp_env import core

MARGIN_M, STEP_RAD, LAST = 0.002, 0.08, 24
LEVELS = core.Levels(MARGIN_M, 0.0015)


def narrow_arm():
    """Returns a toy arm whose second joint can hardly move, so there is a single path."""
    limits = {"lower": np.array([-np.pi, -1e-3]), "upper": np.array([np.pi, 1e-3])}
    return toys.toy_cell(toys.toy_arm("a", [0, 0, 0], **limits))


CELL = narrow_arm()
HERE = np.zeros(2)


def standing(forbidden):
    """Returns the safe intervals of a configuration that is forbidden in each of the windows."""
    balls = [core.Constraint.ball(HERE, 0.1, *window) for window in forbidden]
    return [(int(lo), int(hi)) for lo, hi in core.safe_intervals(CELL.collision.core, 0, HERE, balls, LEVELS)]


def single_arm(start, goal):
    step = np.full(2, STEP_RAD)
    return core.SingleArm(CELL.collision.core, 0, start=start, goals=goal[None], max_step=step, levels=LEVELS, seed=0)


def planned(forbidden, **options):
    start, goal = np.array([-0.4, 0]), np.array([0.4, 0])
    arm = single_arm(start, goal)
    balls = [core.Constraint.ball(HERE, 0.1, *window) for window in forbidden]
    return arm.plan(balls, 0, core.Clock(60.0), settings=core.SingleArmSettings(**options))[0]


@pytest.mark.parametrize(
    ("instant", "expected"),
    [
        (-1, [(0, core.FOREVER)]),
        (0, [(1, core.FOREVER)]),
        (0.5, [(0, 0), (1, core.FOREVER)]),
        (1, [(0, 0), (2, core.FOREVER)]),
        (3.25, [(0, 3), (4, core.FOREVER)]),
        (4, [(0, 3), (5, core.FOREVER)]),
    ],
)
def test_a_stay_contains_no_forbidden_instant(instant, expected):
    assert standing([(instant, instant)]) == expected


quarter = st.integers(-4, 4 * 18).map(lambda n: n / 4)


@settings(max_examples=200)
@given(st.lists(st.tuples(quarter, st.sampled_from([0, 0, 0.25, 1, 1.5, 3, 5])), max_size=5))
def test_safe_intervals_are_the_longest_stays_that_windows_allow(drawn):
    forbidden = [(start, start + length) for start, length in drawn]
    found = [(lo, min(hi, LAST)) for lo, hi in standing(forbidden)]
    expected = windows.stays(forbidden, LAST)
    assert [stay for stay in found if stay[0] < stay[1]] == [stay for stay in expected if stay[0] < stay[1]]
    # A safe interval of a single step is of use only between forbidden instants.
    if any(start == end for start, end in forbidden):
        assert found == expected


@pytest.mark.parametrize("instant", [*np.arange(0, 13, 0.5), 4.3, 5.77])
def test_a_path_avoids_a_forbidden_instant_with_the_least_delay(instant):
    path = planned([(instant, instant)])
    at = np.interp(instant, np.arange(len(path)), path[:, 0])
    assert abs(at) > 0.1 - 1e-6
    # 0.8 rad take ten steps. The ball takes two and a half of them, and each piece of the path takes whole steps.
    assert 10 <= len(path) - 1 <= 10 + 5


def test_a_path_passes_between_many_forbidden_instants():
    instants = [4.5, 12.5, 13.5, 20.25]
    path = planned([(t, t) for t in instants])
    assert (np.abs(np.interp(instants, np.arange(len(path)), path[:, 0])) > 0.1 - 1e-6).all()
    assert len(path) - 1 < 20


def test_a_goal_may_be_forbidden_at_an_instant_but_not_from_then_on():
    start, goal = np.array([-0.4, 0]), HERE
    arm = single_arm(start, goal)
    for end, reached in ((9.5, True), (core.FOREVER, False), (1e300, False), (np.inf, False)):
        closed = core.Constraint.ball(HERE, 0.1, 9.5, end)
        path, _ = arm.plan([closed], 0, core.Clock(60.0), settings=core.SingleArmSettings(max_iterations=50))
        assert (path is not None) == reached
    assert core.Constraint.ball(HERE, 0.1, -np.inf, np.inf).end == core.FOREVER


@pytest.mark.parametrize("window", [(2, 1), (np.nan, 1), (0, np.nan)])
def test_a_window_that_ends_before_it_begins_is_refused(window):
    with pytest.raises(ValueError, match="start"):
        core.Constraint.ball(HERE, 0.1, *window)


@pytest.mark.parametrize(
    ("instant", "broken"), [(4, False), (5, True), (5.4, True), (5.7, True), (5.9, False), (6.5, False), (99, True)]
)
def test_a_motion_breaks_an_instant_only_if_it_is_inside_the_ball_then(instant, broken):
    """The motion passes the ball from 4.75 to 5.75 steps, and ends inside it."""
    rows = np.array([[x, 0.0] for x in (-1.05, -0.85, -0.65, -0.45, -0.25, -0.05, 0.15, 0.35, 0.05)])
    motion = CELL.collision.motion("a", rows)
    ball = core.Constraint.ball(HERE, 0.1, instant, instant)
    assert core.breaks_constraint(CELL.collision.core, motion, [ball], MARGIN_M) == broken
