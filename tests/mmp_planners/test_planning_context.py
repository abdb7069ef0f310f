"""The planning context: single-arm paths on a grid of steps, the plan on a common clock, and its proof."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import two_arms

from mmp_env import check_plan, core
from mmp_env.files.plan_file import plan_to_dict
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext

DT_S, SPEED = 0.1, 0.8
PROBLEM = two_arms.passing()


def context(problem=PROBLEM, seconds=math.inf, **options):
    made = PlanningContext(problem, DT_S, SiRrtStar(**options), core.Clock(seconds))
    made.reseed(0)
    return made


CONTEXT = context()


def straight(arm, steps):
    """Returns a path of equal steps from start to goal."""
    start, goal = PROBLEM.start[CONTEXT.names[arm]], PROBLEM.goal[CONTEXT.names[arm]]
    return CONTEXT.path(arm, start + np.linspace(0, 1, steps + 1)[:, None] * (goal - start))


def test_a_path_knows_its_length_and_stays_at_its_end():
    path = straight(0, 20)
    assert (path.last, path.motion.last, path.motion.arm) == (20, 20, 0)
    assert path.length == pytest.approx(1.6)
    np.testing.assert_allclose(path.at(2.5), (path.q[2] + path.q[3]) / 2)
    for step in (20, 20.5, 99):
        np.testing.assert_array_equal(path.at(step), PROBLEM.goal["left"])


def test_a_path_ends_exactly_where_it_should_and_keeps_the_limits():
    robot = PROBLEM.cell.arm("left").robot
    given_q = np.array([PROBLEM.start["left"] + 1e-7, robot.upper + 1e-6, PROBLEM.goal["left"] - 1e-7])
    path = CONTEXT.path(0, given_q)
    np.testing.assert_array_equal(path.q[[0, -1]], [PROBLEM.start["left"], PROBLEM.goal["left"]])
    assert (path.q <= robot.upper).all()
    assert (given_q[1] > robot.upper).all(), "what was given is left as it was"


def test_pairs_are_all_of_them_or_those_of_one_arm():
    four = context(two_arms.passing())
    four.names = ("a", "b", "c", "d")
    assert four.pairs() == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    assert four.pairs(1) == [(0, 1), (1, 2), (1, 3)]


def test_conflicts_are_the_steps_at_which_surfaces_are_nearer_than_the_margin():
    paths = [straight(0, 20), straight(1, 26)]
    found = CONTEXT.conflicts(paths, CONTEXT.pairs())
    steps = np.arange(27)
    rows = [np.array([path.at(int(k)) for k in steps]) for path in paths]
    gaps = PROBLEM.cell.collision.pair_clearance("left", rows[0], "right", rows[1])
    assert found.keys() == {(0, 1)}
    whole = [k for k in found[0, 1] if k == int(k)]
    np.testing.assert_array_equal(whole, steps[gaps < PROBLEM.conflict_distances.arms])
    assert len(whole) > 2


def test_pairs_without_conflict_are_left_out():
    paths = [
        straight(0, 20),
        CONTEXT.path(1, np.vstack([np.repeat(PROBLEM.start["right"][None], 40, 0), straight(1, 20).q])),
    ]
    assert CONTEXT.conflicts(paths, CONTEXT.pairs()) == {}


def test_all_arms_share_one_clock_and_early_arms_wait():
    paths = [straight(0, 20), straight(1, 26)]
    plan = CONTEXT.plan(paths)
    np.testing.assert_allclose(plan.times, DT_S * np.arange(27))
    np.testing.assert_array_equal(plan.positions["left"][20:], [PROBLEM.goal["left"]] * 7)
    np.testing.assert_array_equal(plan.positions["right"], paths[1].q)
    assert plan.problem is PROBLEM


def test_a_step_too_fast_for_one_arm_is_stretched_for_all():
    """Ten steps for 1.6 rad are twice as fast as 0.8 rad/s, so both arms slow down."""
    paths = [straight(0, 10), straight(1, 26)]
    plan = CONTEXT.plan(paths)
    np.testing.assert_allclose(np.diff(plan.times), [2 * DT_S] * 10 + [DT_S] * 16)
    np.testing.assert_array_equal(plan.positions["right"], paths[1].q)
    assert plan.cost_rad == pytest.approx(sum(path.length for path in paths))
    assert {violation.rule for violation in check_plan(plan).violations} == {"arm-arm"}, "not the speed"


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), lengths=st.tuples(st.integers(1, 12), st.integers(1, 12)))
def test_velocities_are_within_limits_and_no_step_is_slower_than_necessary(seed, lengths):
    rng = np.random.default_rng(seed)
    paths = []
    for arm, last in enumerate(lengths):
        moves = rng.normal(scale=0.1, size=(last + 1, 6)) * (rng.random((last + 1, 1)) < 0.7)
        paths.append(CONTEXT.path(arm, PROBLEM.start[CONTEXT.names[arm]] + np.cumsum(moves, axis=0)))
    plan = CONTEXT.plan(paths)
    durations = np.diff(plan.times)
    needed = [np.abs(np.diff(plan.positions[name], axis=0)).max(axis=1) / SPEED for name in CONTEXT.names]
    np.testing.assert_allclose(durations, np.maximum(DT_S, np.max(needed, axis=0)), rtol=1e-9)
    assert plan.cost_rad == pytest.approx(sum(path.length for path in paths))


def test_a_valid_plan_has_a_proof_and_an_invalid_one_names_the_contact():
    apart = two_arms.one_moves()
    there = context(apart)
    paths = [there.low_level(k, (), 0)[0] for k in (0, 1)]
    proof = there.certify(there.plan(paths))
    assert proof.valid
    assert proof.clearance >= apart.margin
    assert check_plan(plan_to_dict(there.plan(paths))).found_clearance_m >= proof.clearance - 1e-6

    plan = CONTEXT.plan([straight(0, 20), straight(1, 20)])
    proof = CONTEXT.certify(plan)
    assert not proof.valid
    assert (proof.clearance < PROBLEM.margin, proof.arms) == (True, (0, 1))
    at = plan.at(proof.instant * DT_S)
    gap = PROBLEM.cell.collision.pair_clearance("left", [at["left"]], "right", [at["right"]])
    assert gap[0] == pytest.approx(proof.clearance, abs=1e-5)


def test_whether_the_start_of_an_arm_touches_another_one_somewhere():
    near = two_arms.turning((0.0, 1.0), (1.0, -1.0))
    there = context(near)
    assert there.start_touches(0, 1, two_arms.reaching(0.0))
    assert not there.start_touches(0, 1, two_arms.reaching(1.0))


def test_an_expired_clock_gives_no_proof():
    late = context(two_arms.one_moves(), seconds=0.0)
    paths = [
        late.path(k, np.array([late.problem.start[name], late.problem.goal[name]])) for k, name in enumerate(late.names)
    ]
    plan = late.plan(paths)
    assert not late.certify(plan).valid
    assert context(two_arms.one_moves()).certify(plan).valid
