"""Trajectories of schedules: smooth curves that rest between motions and keep the limits of their samples."""

from __future__ import annotations

import numpy as np

from mmp_env.work.trajectory import PERIOD_S, STRAY_RAD, Trajectory, thinned
from tests.support.small_jobs import planned_schedule


def _smooth(rng):
    """Returns samples of a motion from rest to rest, with a rest in its middle."""
    half = np.linspace(0.0, 1.0, 40)
    step = half**4 * (35 - 84 * half + 70 * half**2 - 20 * half**3)
    part = step[:, None] * rng.uniform(-1, 1, 3)
    return np.concatenate([part, np.repeat(part[-1:], 30, axis=0), part[-1] + part])


def test_rests_are_left_out_and_come_back():
    samples = _smooth(np.random.default_rng(0))
    trajectory = thinned(samples)
    assert len(trajectory.times) < len(samples) - 25
    assert np.array_equal(trajectory.samples, samples)


def test_an_arm_at_rest_does_not_move_at_all():
    samples = _smooth(np.random.default_rng(1))
    trajectory = thinned(samples)
    rest = PERIOD_S * np.linspace(41, 69, 200)
    assert np.array_equal(trajectory.at(rest), np.repeat(samples[50:51], 200, axis=0))
    assert not trajectory.velocity(rest).any()


def test_velocities_are_slopes_of_the_curve():
    trajectory = thinned(_smooth(np.random.default_rng(2)))
    times, step = np.linspace(0.01, float(trajectory.times[-1]) - 0.01, 300), 1e-6
    slopes = (trajectory.at(times + step) - trajectory.at(times - step)) / (2 * step)
    assert np.abs(slopes - trajectory.velocity(times)).max() < 1e-6


def test_the_curve_strays_little_from_lines_between_the_times_of_a_proof():
    schedule = planned_schedule()
    plan = schedule.plan
    middle = (plan.times[1:] + plan.times[:-1]) / 2
    for name, trajectory in schedule.trajectories.items():
        straight = (plan.positions[name][1:] + plan.positions[name][:-1]) / 2
        assert np.abs(trajectory.at(middle) - straight).max() <= STRAY_RAD


def test_a_trajectory_of_one_sample_stands_still():
    trajectory = Trajectory(times=np.zeros(1), positions=np.ones((1, 2)))
    assert np.array_equal(trajectory.at(np.array([0.0, 5.0])), np.ones((2, 2)))


def test_schedules_keep_every_limit_from_the_first_job_to_the_last():
    schedule = planned_schedule()
    for name, trajectory in schedule.trajectories.items():
        rows = np.pad(trajectory.samples, ((3, 3), (0, 0)), mode="edge")
        limits = schedule.problem.max_velocity, schedule.max_acceleration, schedule.max_jerk
        for order, limit in enumerate(limits, 1):
            rate = np.abs(np.diff(rows, n=order, axis=0)).max(axis=0) / PERIOD_S**order
            assert (rate <= np.asarray(limit[name]) * (1 + 1e-9)).all()
