"""Retimed plans: limits by differences of the samples, tolerance of the path, proof, and rest at both ends."""

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import cornered_plans, two_arms
from support.cornered_plans import cornered_plan, largest_shares, side_by_side

from mmp_env import check_plan
from mmp_env.errors import MmpError
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.plan_fit import given_plan
from mmp_env.model.robot_reading import load_robot
from mmp_env.problems.making import make_problem
from mmp_env.retime import retime, retime_with_report

ROUNDING = 1e-6
seeds, counts = st.integers(0, 2**32), st.integers(0, 8)


@settings(max_examples=30)
@given(seed=seeds, corners=counts, speed=st.sampled_from([0.4, 0.8, 2.0]), rate=st.sampled_from([100.0, 250.0, 1000.0]))
def test_every_limit_holds_by_differences_of_the_samples(seed, corners, speed, rate):
    plan = cornered_plan(seed, corners, max_velocity=speed)
    velocity, acceleration, jerk = largest_shares(retime(plan, rate=rate))
    assert velocity <= 1 + ROUNDING
    assert acceleration <= 0.9 + ROUNDING
    assert jerk <= 0.9 + ROUNDING


@settings(max_examples=15)
@given(seed=seeds, corners=counts, acceleration=st.floats(0.5, 50.0), ramp_s=st.floats(1e-3, 0.5))
def test_limits_that_are_given_hold_too_and_the_checker_finds_no_fault(seed, corners, acceleration, ramp_s):
    plan = retime(cornered_plan(seed, corners), max_acceleration=acceleration, max_jerk=acceleration / ramp_s)
    assert max(largest_shares(plan)) <= 1 + ROUNDING
    assert check_plan(plan).violations == ()


@settings(max_examples=25)
@given(seed=seeds, corners=counts, tolerance=st.sampled_from([1e-9, 1e-5, 1e-3, 0.02, 0.3]))
def test_the_path_stays_within_the_tolerance(seed, corners, tolerance):
    plan = cornered_plan(seed, corners)
    smooth, report = retime_with_report(plan, tolerance=tolerance)
    lines = side_by_side(plan, plan.positions)
    far = cornered_plans.distance_to_lines(side_by_side(plan, smooth.positions), lines)
    # The polyline of the samples cuts corners slightly; the path itself keeps the tolerance.
    assert far.max() <= 2 * np.sqrt(12) * tolerance + 1e-9
    assert report.deviation_rad <= tolerance + 1e-12
    assert report.tolerance_rad == tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5])
def test_many_small_blends_together_keep_the_tolerance(tolerance):
    report = retime_with_report(cornered_plan(1, 300, turn=1e-4), tolerance=tolerance)[1]
    assert (report.corners, report.stops) == (300, 0)
    assert 0.5 * tolerance < report.deviation_rad <= tolerance


@settings(max_examples=15)
@given(seed=seeds, corners=counts)
def test_a_retimed_plan_starts_and_ends_at_rest_with_the_plan(seed, corners):
    plan = cornered_plan(seed, corners)
    smooth = retime(plan)
    for name, q in smooth.positions.items():
        np.testing.assert_array_equal(q[[0, -1]], plan.positions[name][[0, -1]])
        for rates in (smooth.velocities, smooth.accelerations):
            assert np.abs(rates[name][[0, -1]]).max() == 0


def test_stated_rates_are_those_of_the_motion():
    smooth = retime(cornered_plan(3, 4), rate=1000.0)
    q, v, a = (side_by_side(smooth, values) for values in (smooth.positions, smooth.velocities, smooth.accelerations))
    step = smooth.times[1]
    np.testing.assert_allclose((q[2:] - q[:-2]) / (2 * step), v[1:-1], atol=2e-3)
    np.testing.assert_allclose(np.diff(q, n=2, axis=0) / step**2, a[1:-1], atol=0.5 * 4000 * step)


def test_a_retimed_plan_lasts_little_longer_than_velocity_limits_require():
    ratios = [retime_with_report(cornered_plan(seed, 3))[1].ratio for seed in range(5)]
    assert max(ratios) < 1.15


def at_most(plan, speed):
    """Returns the plan with another velocity limit, for robots without one."""
    limits = {name: np.full(len(v), speed) for name, v in plan.problem.max_velocity.items()}
    return dataclasses.replace(plan, problem=dataclasses.replace(plan.problem, max_velocity=limits))


@pytest.mark.parametrize(("corners", "turn"), [(0, 0.4), (3, 0.4), (8, 0.4), (30, 0.1)])
def test_a_higher_velocity_limit_makes_no_motion_longer(corners, turn):
    plan = cornered_plan(2, corners, turn=turn)
    lasting = [retime(at_most(plan, speed), rate=100.0).makespan_s for speed in (0.8, 1.5, 3.0, 5.0, 20.0, 200.0)]
    assert (np.array(lasting) <= 1.03 * np.minimum.accumulate(lasting) + 0.01).all()


@settings(max_examples=5)
@given(seed=seeds, corners=st.integers(0, 3), jerk=st.sampled_from([100.0, 4000.0, 1e6]))
def test_a_higher_acceleration_limit_makes_no_motion_longer(seed, corners, jerk):
    plan = cornered_plan(seed, corners)
    options = [{"max_acceleration": limit, "max_jerk": jerk} for limit in (4.0, 10.0, 1000.0)]
    lasting = [retime(plan, rate=100.0, **each).makespan_s for each in options]
    assert (np.array(lasting) <= 1.03 * np.minimum.accumulate(lasting) + 0.01).all()


@pytest.mark.parametrize("speed", [3.0, 50.0, 1000.0])
def test_a_straight_line_takes_little_longer_than_acceleration_limits_require(speed):
    plan = at_most(cornered_plan(4, 0), speed)
    distance = max(np.abs(q[1] - q[0]).max() for q in plan.positions.values())
    assert retime(plan, share=1.0).makespan_s < 1.1 * 2 * np.sqrt(distance / 8.0)


def test_many_short_lines_take_much_less_than_with_a_stop_at_each_corner():
    plan = at_most(cornered_plan(4, 30, turn=0.1), 50.0)
    stopping = retime(plan, tolerance=1e-12).makespan_s
    assert retime(plan).makespan_s < 0.62 * stopping


def test_the_report_has_ascending_makespans_and_the_plan_keeps_it():
    plan = cornered_plan(1, 5)
    slow = dataclasses.replace(plan, times=1.5 * plan.times, stats={"restarts": 2})
    smooth, report = retime_with_report(slow)
    assert report.given_s == slow.makespan_s == pytest.approx(1.5 * report.fastest_s)
    assert report.smoothed_s <= report.fastest_s < report.makespan_s == smooth.makespan_s < report.given_s
    assert (report.corners, report.stops) == (5, 0)
    assert report.clearance_m >= plan.problem.margin
    kept = {key: value for key, value in dataclasses.asdict(report).items() if key != "seconds"}
    assert smooth.stats["retimed"] == kept
    assert smooth.stats["restarts"] == 2


def test_waits_and_straight_corners_make_no_difference():
    plan = cornered_plan(2, 3)
    shares = np.sort(np.concatenate([np.linspace(0, 1, 40), plan.times / plan.makespan_s]))
    times = np.concatenate([shares * plan.makespan_s, plan.makespan_s + np.arange(1, 4)])
    rows = {name: np.array([plan.at(t)[name] for t in times]) for name in plan.positions}
    waiting = dataclasses.replace(plan, times=times + 1e-6 * np.arange(len(times)), positions=rows)
    ours, theirs = retime_with_report(plan)[1], retime_with_report(waiting)[1]
    assert theirs.corners == ours.corners
    assert theirs.makespan_s == pytest.approx(ours.makespan_s, abs=0.005)


def test_a_plan_in_which_nothing_moves_stays_as_it_is():
    problem = two_arms.nothing_to_do()
    plan = cornered_plans.plan_through(problem, {name: np.array([q, q]) for name, q in problem.start.items()})
    smooth = retime(plan)
    assert smooth.makespan_s == pytest.approx(0.004)
    assert check_plan(smooth).valid


def test_a_file_keeps_everything_and_gives_the_same_bytes():
    written = plan_to_dict(retime(cornered_plan(4, 2)))
    assert {"velocities", "accelerations"} < written.keys()
    assert written["problem"]["max_acceleration"]["left"] == load_robot("ur5e").acceleration.tolist()
    assert plan_to_dict(plan_from_dict(written)) == written


def test_a_colliding_plan_is_refused():
    problem = two_arms.passing(1.4)
    plan = cornered_plans.plan_through(
        problem, {name: np.array([problem.start[name], problem.goal[name]]) for name in problem.start}
    )
    with pytest.raises(MmpError, match="cannot be proved clear of conflicts"):
        retime(plan)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rate": 0}, "rate is 0; it must be a positive number"),
        ({"rate": float("nan")}, "rate is nan"),
        ({"tolerance": -0.1}, "tolerance is -0.1"),
        ({"rat": 100.0}, "unknown argument of retime() 'rat'. Did you mean 'rate'"),
        (
            {"max_jerk": {"left": ["a"] * 6, "right": [1.0] * 6}},
            "max_jerk of arm 'left' must be a positive number, or 6 of them",
        ),
        ({"rate": 1e5, "max_acceleration": 0.05}, "more than 1000000 samples; its limits are too low"),
        ({"share": 1.5}, "share is 1.5; it must be a positive number, 1 at most"),
        ({"max_acceleration": 0.0}, "max_acceleration of arm 'left' must be a positive number, or 6 of them"),
        ({"max_acceleration": 1e-320}, "max_acceleration is 1e-320; it must be 1e-09 at least"),
        ({"max_jerk": 1e-320}, "max_jerk is 1e-320; it must be 1e-09 at least"),
        ({"max_jerk": {"left": 1e-320, "right": 1.0}}, "max_jerk of arm 'left' is 1e-320; it must be 1e-09 at least"),
        ({"max_jerk": {"left": True, "right": 1.0}}, "max_jerk of arm 'left' must be a positive number, or 6 of them"),
        ({"max_jerk": {"left": [1.0] * 6}}, "max_jerk has no entry for arm 'right'"),
        ({"max_jerk": {"lefd": [1.0] * 6}}, "Did you mean 'left'"),
        ({"max_acceleration": {"left": [1.0] * 5, "right": [1.0] * 6}}, "must be a positive number, or 6 of them"),
    ],
)
def test_values_that_make_no_sense_are_named(options, words):
    with pytest.raises(MmpError, match=re.escape(words)):
        retime(cornered_plan(0, 1), **options)


@pytest.mark.parametrize("limit", ["max_acceleration", "max_jerk"])
def test_a_number_for_an_arm_is_the_limit_of_each_of_its_joints(limit):
    plan = retime(cornered_plan(0, 1), **{limit: {"left": 1.0, "right": np.float32(2.0)}})
    each = retime(cornered_plan(0, 1), **{limit: {"left": [1.0] * 6, "right": [2.0] * 6}})
    assert plan_to_dict(plan) == plan_to_dict(each)


@pytest.mark.parametrize(
    "options",
    [
        {"max_acceleration": 1e300, "max_jerk": 1e300},
        {"max_acceleration": 1e6},
        {"max_jerk": 1e6},
        {"max_jerk": 1e300},
        {"max_jerk": 0.1},
        {"max_acceleration": 0.01},
        {"rate": 10_000.0},
        {"tolerance": 1e-300},
        {"share": 0.01},
    ],
)
def test_limits_and_rates_far_from_usual_are_kept_like_others(options):
    plan = retime(cornered_plan(3, 1), **options)
    assert max(largest_shares(plan)) <= 1 + ROUNDING
    assert check_plan(plan).valid


@pytest.mark.parametrize("distance", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3])
def test_one_arm_may_move_by_very_little(distance):
    q = two_arms.reaching(0.0)
    cell = Cell(name="alone", arms=(place_arm("only", "ur5e", [0, 0, 0], np.eye(4)[0]),), obstacles=())
    problem = make_problem(cell, {"only": q}, {"only": q + distance})
    plan = retime(cornered_plans.plan_through(problem, {"only": np.array([q, q + distance])}))
    assert max(largest_shares(plan)) <= 1 + ROUNDING
    assert check_plan(plan).violations == ()
    assert plan.makespan_s < 0.5


@pytest.mark.parametrize("distance", [1e-10, 1e-8, 1e-6, 5e-6, 2e-5])
@pytest.mark.parametrize("row", [1, 2, 4])
@pytest.mark.parametrize("rate", [1000.0, 20_000.0])
def test_a_tiny_move_within_a_plan_keeps_the_limits(distance, row, rate):
    plan = cornered_plan(5, 3)
    rows = {name: np.insert(q, row, q[row], axis=0) for name, q in plan.positions.items()}
    if row == 1:  # from the start; later ones end at a waypoint
        rows = {name: np.insert(q, 1, q[0], axis=0) for name, q in plan.positions.items()}
    shift = distance * np.random.default_rng(row).uniform(-1, 1, 6)
    for q in rows.values():
        q[row] += shift
    found = retime(cornered_plans.plan_through(plan.problem, rows), rate=rate, tolerance=1e-9)
    assert max(largest_shares(found)) <= 1 + ROUNDING
    assert check_plan(found).violations == ()


@settings(max_examples=15)
@given(seed=seeds, count=st.integers(2, 8), size=st.sampled_from([1e-4, 1e-6, 1e-8]))
def test_many_tiny_moves_with_stops_keep_the_limits(seed, count, size):
    plan, rng = cornered_plan(seed, 2), np.random.default_rng(seed)
    rows = {name: np.repeat(q, count, axis=0) for name, q in plan.positions.items()}
    for q in rows.values():
        q[1:-1] += size * 10.0 ** rng.uniform(-4, 0, (len(q) - 2, 1)) * rng.uniform(-1, 1, (len(q) - 2, 6))
    found = retime(cornered_plans.plan_through(plan.problem, rows), rate=10_000.0, tolerance=1e-9)
    assert max(largest_shares(found)) <= 1 + ROUNDING


def test_a_plan_that_is_retimed_already_is_refused():
    with pytest.raises(MmpError, match="retimed already"):
        retime(retime(cornered_plan(0, 1)))


def test_a_planner_that_found_no_plan_has_none_to_retime():
    with pytest.raises(MmpError, match="there is no plan to retime; the status of the planner's result says why"):
        retime(None)


def test_a_value_that_is_no_plan_is_refused_with_its_type():
    with pytest.raises(MmpError, match="the plan to retime is of type str; it must be a Plan"):
        given_plan("plan.json", "retime")


def test_a_plan_without_some_arm_is_refused():
    plan = cornered_plan(0, 1)
    with pytest.raises(MmpError, match="does not say where arm 'right' of its cell is"):
        retime(dataclasses.replace(plan, positions={"left": plan.positions["left"]}))


def test_a_negligible_motion_is_no_motion():
    plan = cornered_plan(0, 0)
    still = {name: np.repeat(q[:1], 4, axis=0) for name, q in plan.positions.items()}
    some = next(iter(still))
    still[some] = still[some] + np.array([0.0, 1e-9, 0.0, 0.0])[:, None]
    problem = dataclasses.replace(plan.problem, goal=plan.problem.start)
    found = retime(dataclasses.replace(plan, problem=problem, times=np.array([0.0, 5.0, 6.0, 9.0]), positions=still))
    assert found.makespan_s < 0.1
    assert check_plan(found).violations == ()


def test_a_plan_of_one_sample_stays_where_it_is():
    plan = cornered_plan(0, 1)
    problem = dataclasses.replace(plan.problem, goal=plan.problem.start)
    start = {name: q[:1] for name, q in plan.positions.items()}
    found = retime(dataclasses.replace(plan, problem=problem, times=np.zeros(1), positions=start))
    assert 0.0 < found.makespan_s <= 0.004
    assert check_plan(found).violations == ()
    for name, q in start.items():
        np.testing.assert_array_equal(found.positions[name], np.repeat(q, len(found.times), axis=0))


def test_too_low_a_rate_is_refused_with_a_sentence():
    plan = cornered_plan(0, 1)
    with pytest.raises(MmpError, match="at least 20 samples a second"):
        retime(plan, rate=7.0)
