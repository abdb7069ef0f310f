"""The parts of retiming: courses, blends, zones and their clock, each against its own specification."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import two_arms
from support.cornered_plans import cornered_plan, distance_to_lines, plan_through, side_by_side

from mmp_env import check_plan
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.problems.making import make_problem
from mmp_env.retime import proof, retime_with_report
from mmp_env.retime.clock import run_clock, speeds_at_bounds
from mmp_env.retime.course import Course, course_of
from mmp_env.retime.limits import RateLimits, rate_limits
from mmp_env.retime.smoothing import deviation, first_blends, troubles
from mmp_env.retime.steps import finished
from mmp_env.retime.zones import Zones, zones_of

seeds = st.integers(0, 2**32)


def random_path(seed, *, stops=0.0):
    """Returns a course of three joints with blends, some of which are stops."""
    rng = np.random.default_rng(seed)
    slopes = rng.uniform(-0.8, 0.8, (6, 3))
    phases = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 0.6, 6))])
    q = np.concatenate([np.zeros((1, 3)), np.cumsum(slopes * np.diff(phases)[:, None], axis=0)])
    limits = RateLimits(velocity=np.full(3, 0.8), acceleration=np.full(3, 8.0), jerk=np.full(3, 4000.0))
    path = first_blends(Course(phases=phases, q=q, slopes=slopes), limits, 0.05)
    return path.narrower(np.where(rng.uniform(size=5) < stops, 0.0, 1.0)), limits


@given(seed=seeds)
def test_derivatives_of_a_blended_path_are_its_differences(seed):
    path, _ = random_path(seed)
    phase, h = np.linspace(0.01, path.course.end - 0.01, 200), 1e-6
    slope, curve, change = path.derivatives(phase, (1, 2, 3))
    np.testing.assert_allclose((path.at(phase + h) - path.at(phase - h)) / (2 * h), slope, atol=1e-3)
    before, after = (path.derivatives(phase + d, (1,))[0] for d in (-h, h))
    np.testing.assert_allclose((after - before) / (2 * h), curve, atol=0.02)
    whole = np.array([not ((path.breaks > u - 2 * h) & (path.breaks < u + 2 * h)).any() for u in phase])
    before, after = (path.derivatives(phase + d, (2,))[0] for d in (-h, h))
    np.testing.assert_allclose(((after - before) / (2 * h))[whole], change[whole], rtol=1e-6, atol=1e-6)


@given(seed=seeds)
def test_a_path_is_the_sum_of_its_course_and_its_blends(seed):
    path, _ = random_path(seed, stops=0.2)
    phase = np.linspace(0.0, path.course.end, 301)
    np.testing.assert_allclose(path.at(phase), path.course.at(phase) + path.off_course(phase)[0], atol=1e-12)


@given(seed=seeds)
def test_a_blend_misses_its_corner_by_its_deviation_and_changes_nothing_beyond_its_reach(seed):
    path, _ = random_path(seed)
    alone = path.narrower(np.eye(5)[2])
    corner, reach = path.corners[2], path.reach[2]
    off = np.abs(alone.at(np.array([corner])) - path.course.at(np.array([corner]))).max()
    assert off == pytest.approx(path.miss[2], rel=1e-6)
    outside = np.array([0.0, corner - 1.001 * reach, corner + 1.001 * reach, path.course.end])
    np.testing.assert_allclose(alone.at(outside), path.course.at(outside), atol=1e-12)


def test_a_course_turns_only_at_corners_and_is_as_fast_as_velocities_allow():
    plan = cornered_plan(5, 4)
    velocity = rate_limits(plan.problem).velocity
    course = course_of(plan, velocity)
    assert len(course.phases) == 6
    np.testing.assert_allclose((np.abs(course.slopes) / velocity).max(axis=1), 1.0)
    assert course.end == pytest.approx(plan.makespan_s)


def test_many_slight_bends_do_not_count_as_a_straight_line():
    plan = cornered_plan(5, 0)
    shares = np.linspace(0, 1, 400)[:, None]
    bump = 1e-6 * np.sin(np.pi * shares) * np.eye(6)[5]
    rows = {name: q[0] + shares * (q[-1] - q[0]) + bump for name, q in plan.positions.items()}
    bent = dataclasses.replace(plan, times=plan.makespan_s * shares[:, 0], positions=rows)
    course = course_of(bent, rate_limits(plan.problem).velocity)
    assert len(course.q) < 400
    assert distance_to_lines(side_by_side(bent, rows), course.q).max() < 1e-7


@settings(max_examples=40)
@given(seed=seeds)
def test_no_zone_allows_a_joint_more_than_its_limits(seed):
    path, limits = random_path(seed, stops=0.2)
    zones = finished(zones_of(path, limits))
    rng = np.random.default_rng(seed)
    for k in range(len(zones.speed)):
        phase = np.sort(rng.uniform(zones.bounds[k], zones.bounds[k + 1], 20))
        slope, curve = path.derivatives(phase, (1, 2))
        speed, growth = zones.speed[k], zones.growth[k]
        assert (np.abs(slope) * speed <= limits.velocity * (1 + 1e-9)).all()
        assert (np.abs(curve) * speed**2 + np.abs(slope) * growth <= limits.acceleration * (1 + 1e-9)).all()
        assert zones.jerk[k] > 0


@settings(max_examples=40)
@given(seed=seeds, count=st.integers(1, 12))
def test_the_clock_keeps_the_limits_of_zones_and_arrives_at_rest(seed, count):
    rng = np.random.default_rng(seed)
    stop = np.append(np.insert(rng.uniform(size=count - 1) < 0.2, 0, True), True)
    zones = Zones(
        bounds=np.concatenate([[0.0], np.cumsum(rng.uniform(0.001, 0.3, count))]),
        speed=rng.uniform(0.05, 3.0, count),
        growth=rng.uniform(0.5, 20.0, count),
        jerk=rng.uniform(5.0, 5000.0, count),
        stop=stop,
    )
    clock = run_clock(zones, 0.001)
    assert (np.diff(clock.phase) >= -1e-9).all()
    assert (clock.phase[0], clock.speed[0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert (clock.phase[-1], clock.speed[-1], clock.growth[-1]) == (zones.bounds[-1], 0.0, 0.0)
    zone = np.clip(np.searchsorted(zones.bounds, clock.phase, side="right") - 1, 0, count - 1)
    near = np.maximum.reduce([zones.speed[zone], zones.speed[np.maximum(zone - 1, 0)]])
    assert (clock.speed <= near + 1e-6).all()
    assert (np.abs(clock.growth) <= zones.growth[zone] + 1e-6).sum() >= len(zone) - 2 * count  # samples at bounds
    assert (np.diff(clock.phase) / 0.001 <= zones.speed.max() + 1e-6).all()
    for bound in zones.bounds[1:-1][stop[1:-1]]:
        assert (np.abs(clock.phase - bound) < 1e-9).any()


@settings(max_examples=40)
@given(seed=seeds, count=st.integers(1, 12), shortest=st.sampled_from([1e-2, 1e-5, 1e-9, 1e-13]))
def test_the_clock_is_continuous_and_keeps_the_jerk_however_short_its_zones(seed, count, shortest):
    rng = np.random.default_rng(seed)
    lengths = shortest * rng.uniform(1.0, 10.0, count)
    zones = Zones(
        bounds=np.concatenate([[0.0], np.cumsum(lengths)]),
        speed=rng.uniform(0.05, 3.0, count),
        growth=rng.uniform(0.5, 20.0, count),
        jerk=rng.uniform(5.0, 5000.0, count),
        stop=np.concatenate([[True], (rng.uniform(size=count - 1) < 0.5) | (shortest < 1e-5), [True]]),
    )
    period_s = 1e-5
    clock = run_clock(zones, period_s)
    assert (clock.phase[0], clock.phase[-1]) == (0.0, zones.bounds[-1])
    rounding = 8 * np.spacing(zones.bounds[-1]) / period_s**3
    assert np.abs(np.diff(clock.phase, n=3)).max(initial=0.0) / period_s**3 <= zones.jerk.max() * (1 + 1e-6) + rounding
    assert np.abs(np.diff(clock.phase, n=2)).max(initial=0.0) / period_s**2 <= zones.growth.max() * (1 + 1e-3)


@given(
    slow=st.floats(1e-3, 1.0),
    length=st.floats(1e-4, 1.0),
    growth=st.floats(0.01, 100.0),
    jerk=st.floats(0.1, 1e4),
)
def test_a_zone_is_left_at_the_highest_speed_that_can_be_reached_in_it(slow, length, growth, jerk):
    def distance(speed):
        change, ramp = speed - slow, growth / jerk
        lasting = change / growth + ramp if change > growth * ramp else 2 * np.sqrt(change / jerk)
        return lasting * (slow + speed) / 2

    high, far = 1e3, 1e7
    zones = Zones(
        bounds=np.cumsum([0.0, far, length, far]),
        speed=np.array([slow, high, high]),
        growth=np.full(3, growth),
        jerk=np.full(3, jerk),
        stop=np.array([True, False, False, True]),
    )
    _, first, second, _ = speeds_at_bounds(zones)
    assert first == slow
    assert distance(second) <= length * (1 + 1e-9)
    assert second == high or distance(second) >= length * (1 - 1e-5)


def test_a_path_that_stops_at_every_corner_is_the_course_itself():
    plan = cornered_plan(7, 5)
    still, report = retime_with_report(plan, tolerance=1e-12)
    assert report.stops == report.corners == 5
    assert report.deviation_rad == 0
    speeds = np.abs(np.concatenate(list(still.velocities.values()), axis=1)).max(axis=1)
    rests = [list(group) for resting, group in itertools.groupby(speeds < 1e-9) if resting]
    assert len(rests) == 7
    assert check_plan(still).valid


def with_ball(where, radius):
    ball = Obstacle(name="ball", shape="sphere", position=where, quaternion=np.eye(4)[0], radius=radius)
    return Cell(name="hook", arms=(place_arm("only", "ur5e", [0, 0, 0], np.eye(4)[0]),), obstacles=(ball,))


@functools.cache
def hooking(clear_m):
    """Returns a plan of an arm that turns and then lifts, with a ball inside the corner, `clear_m` [m] away."""
    corner = two_arms.reaching(0.0)
    rows = corner + np.array([[0.6, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, -0.4, 0, 0, 0, 0]])
    course = np.concatenate([a + np.linspace(0, 1, 200)[:, None] * (b - a) for a, b in itertools.pairwise(rows)])
    cut = corner + np.outer(np.linspace(0.2, 1, 9), (0.05, -0.05, 0, 0, 0, 0))
    far = with_ball(np.full(3, 5.0), 1e-3)
    near = far.collision.tool_points("only", corner[None])[0] + np.random.default_rng(0).normal(0, 0.1, (80, 3))
    gains = []
    for where in near:
        clearance = with_ball(where, 1e-3).collision.clearance
        along, across = (float(clearance({"only": q}).min()) for q in (course, cut))
        gains.append((along - across if along > 0.01 else 0.0, along))
    best = int(np.argmax([gain for gain, _ in gains]))
    cell = with_ball(near[best], 1e-3 + gains[best][1] - clear_m)
    return plan_through(make_problem(cell, {"only": rows[0]}, {"only": rows[-1]}, margin=0.001), {"only": rows})


def wide_blends(plan):
    limits = rate_limits(plan.problem, 3.0).reduced(0.9)
    return first_blends(course_of(plan, limits.velocity), limits, 1.0)


def test_a_blend_is_narrowed_by_an_obstacle_inside_it():
    plan = hooking(0.0011)
    wide = wide_blends(plan)
    look = np.linspace(0, wide.course.end, 500)
    assert len(finished(troubles(plan.problem, wide, [look], 1.0))) > 0
    narrow, report = retime_with_report(plan, tolerance=1.0, max_acceleration=3.0)
    assert 0 < report.deviation_rad < 0.2 * deviation(wide, look).max()
    assert check_plan(narrow).valid


def unchanged(problem, path, tolerance):
    """Stands in for `smooth`, and finds nothing to narrow."""
    yield
    return path


def test_the_proof_of_the_result_finds_contacts_that_the_samples_miss(monkeypatch):
    monkeypatch.setattr(proof, "smooth", unchanged)
    plan = hooking(0.0011)
    narrow, report = retime_with_report(plan, tolerance=1.0, max_acceleration=3.0)
    assert report.deviation_rad < 0.5 * wide_blends(plan).miss.max()
    assert check_plan(narrow).valid
