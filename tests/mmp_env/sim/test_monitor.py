"""The execution monitor: all arms stop on the common phase when one lags, within limits, and continue later."""

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cornered_plans import cornered_plan, side_by_side

from mmp_env.errors import MmpError
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.retime import retime
from mmp_env.sim.execution import execute_plan
from mmp_env.sim.monitor import Monitor, MonitorRun
from mmp_env.sim.phase_clock import PhaseClock
from mmp_env.sim.servo_reference import Reference
from mmp_env.sim.simulation import Simulation

STEP_S = 0.002
BLOCKED_S = (0.5, 1.6)


@functools.cache
def smooth_plan(*, share=0.9):
    return retime(cornered_plan(11, 3), share=share)


def reference_of(plan):
    return Reference(plan, {name: q[0] for name, q in plan.positions.items()})


@functools.cache
def blocked(monitor, *spans_s, plan=None):
    """Returns an execution in which strong friction holds the second joint of the left arm in these spans of time."""
    plan = plan or smooth_plan()
    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    joint = simulation.slices["left"].start + 1

    def tar():
        held = any(begin <= simulation.data.time < end for begin, end in spans_s or (BLOCKED_S,))
        simulation.model.dof_damping[joint] = 1e6 if held else 0.0

    return execute_plan(simulation, plan, tar, monitor)


def test_an_arm_that_is_held_stops_all_arms_until_it_has_caught_up():
    free, held = blocked(None), blocked(Monitor(lag_rad=0.01))
    assert held.reached
    assert held.contacts == []
    (halt,) = held.halts
    assert (halt.arm, halt.joint) == ("left", 2)
    assert BLOCKED_S[0] < halt.time_s < BLOCKED_S[1] < halt.until_s < BLOCKED_S[1] + 0.2
    assert 0.01 < halt.lag_rad <= held.max_tracking_error_rad < free.max_tracking_error_rad
    assert held.duration_s > free.duration_s + 0.5
    resting = np.diff(held.phases) == 0
    assert resting[np.searchsorted(held.times, halt.time_s + 0.5) : np.searchsorted(held.times, BLOCKED_S[1])].all()


def test_the_other_arm_stays_on_its_path_and_stands_while_all_wait():
    report = blocked(Monitor(lag_rad=0.01))
    wanted, _ = reference_of(smooth_plan()).at(report.phases)
    assert np.abs(report.positions["right"] - wanted[:, 6:]).max() < 2e-3
    waiting = report.times[:-1][np.diff(report.phases) == 0]
    rows = np.searchsorted(report.times, [waiting[100], waiting[200]])
    assert np.abs(np.diff(report.positions["right"][rows], axis=0)).max() < 1e-4


def assert_within_limits(plan, phases, step_s=STEP_S):
    """Checks derivatives by differences of the references. Third differences have 1e-3 rad/s^3 of rounding."""
    rate, _ = reference_of(plan).at(np.asarray(phases))
    rate = np.pad(rate, ((3, 3), (0, 0)), mode="edge")
    for limits, noise in ((plan.problem.max_velocity, 0.0), (plan.max_acceleration, 1e-8), (plan.max_jerk, 1e-3)):
        rate = np.diff(rate, axis=0) / step_s
        assert (np.abs(rate) <= side_by_side(plan, limits) * (1 + 1e-6) + noise).all()


def test_stops_and_restarts_keep_the_limits_of_every_joint():
    report = blocked(Monitor(lag_rad=0.01))
    assert_within_limits(smooth_plan(), report.phases)


def test_an_execution_without_lag_is_the_same_with_a_monitor():
    env = MultiArmCellEnv(cell=smooth_plan().problem.cell)
    with_it, without = (env.execute(smooth_plan(), monitor=monitor) for monitor in (Monitor(), None))
    assert with_it.halts == without.halts == []
    assert with_it.max_tracking_error_rad == pytest.approx(without.max_tracking_error_rad, rel=1e-2)
    assert with_it.max_tracking_error_rad < 1e-3
    np.testing.assert_allclose(with_it.phases, without.phases, atol=1e-9)


def test_an_execution_is_given_up_after_the_patience_with_a_sentence():
    report = blocked(Monitor(lag_rad=0.01, patience_s=0.5), (BLOCKED_S[0], np.inf))
    assert report.given_up
    assert not report.reached
    halt = report.halts[-1]
    assert halt.until_s is None
    assert "joint 2 of 'left' lagged, by 0.0" in str(halt)
    assert "did not catch up: given up" in str(halt)
    assert halt.phase_s == report.phases[-1] < smooth_plan().makespan_s
    assert report.duration_s < 3


def test_an_arm_that_is_delayed_ten_times_arrives():
    spans = [(0.3 + 0.6 * k, 0.55 + 0.6 * k) for k in range(10)]
    report = blocked(Monitor(lag_rad=0.005, caught_up_rad=0.002), *spans)
    assert report.reached
    assert report.contacts == []
    assert len(report.halts) >= 5
    assert all(halt.until_s > halt.time_s for halt in report.halts)
    assert_within_limits(smooth_plan(), report.phases)


def test_a_halt_that_the_end_of_the_plan_cuts_off_lasts_until_the_arm_has_caught_up():
    end = smooth_plan().makespan_s
    report = blocked(Monitor(lag_rad=0.001, caught_up_rad=0.0005), (end - 0.25, end + 0.8))
    (halt,) = report.halts
    assert report.phases[-1] == halt.phase_s == pytest.approx(end)
    assert end < halt.until_s < report.duration_s
    assert not report.given_up
    assert report.reached


def test_an_arm_that_lags_at_every_restart_ends_the_execution():
    clock, step_s = PhaseClock(reference_of(smooth_plan())), 0.01
    run = MonitorRun(Monitor(patience_s=3.0), clock, [("left", 1)])
    looks = 0
    while not run.over and looks < 10_000:
        clock.advance(step_s)
        run.update(looks * step_s, np.array([0.0 if clock.at_rest else 0.1]), step_s)
        looks += 1
    assert 300 < looks < 10_000
    assert len(run.halts) > 5


def turned(plan, turns, step_s=STEP_S):
    """Returns the phases at each step of a clock whose target changes after each of these times [s], to 1 at last."""
    clock = PhaseClock(reference_of(plan))
    phases = [clock.phase]
    for k, lasting in enumerate([*turns, np.inf]):
        clock.set_target(1.0 if lasting == np.inf else float(k % 2))
        end = len(phases) + lasting / step_s
        while len(phases) < end and not clock.over:
            clock.advance(step_s)
            phases.append(clock.phase)
    return np.array(phases)


@settings(max_examples=20)
@given(
    seed=st.integers(0, 2**32),
    turns=st.lists(st.one_of(st.floats(0.001, 0.05), st.floats(0.01, 0.6)), max_size=20),
    rate=st.sampled_from([20.0, 50.0, 250.0, 1000.0]),
    share=st.sampled_from([0.5, 0.9, 0.95]),
    limits=st.sampled_from([{}, {"max_acceleration": 5.0, "max_jerk": 50.0}, {"max_acceleration": 50.0}]),
    step_s=st.sampled_from([0.002, 0.005]),
)
def test_all_joints_keep_their_limits_however_often_the_target_changes(seed, turns, rate, share, limits, step_s):
    plan = retime(cornered_plan(seed, 1), rate=rate, share=share, **limits)
    phases = turned(plan, turns, step_s)
    assert (np.diff(phases) >= 0).all()
    assert (np.diff(phases) <= step_s * (1 + 1e-9)).all()
    assert phases[-1] == pytest.approx(plan.makespan_s + plan.times[1])
    assert_within_limits(plan, phases, step_s)


@given(at=st.floats(0.0, 2.0), share=st.sampled_from([0.5, 0.9]))
def test_a_stop_comes_to_rest_soon_and_for_good(at, share):
    clock = PhaseClock(reference_of(smooth_plan(share=share)))
    clock.advance(at)
    clock.set_target(0.0)
    clock.advance(1.5 if share == 0.9 else 0.5)
    assert clock.at_rest or clock.over
    stood = clock.phase
    clock.advance(1.0)
    assert clock.phase == stood


def test_the_phase_does_not_depend_on_the_time_step():
    clocks = [PhaseClock(reference_of(smooth_plan())) for _ in range(2)]
    for target in (0.0, 1.0, 0.0, 1.0):
        for clock, steps in zip(clocks, (1, 37), strict=True):
            clock.set_target(target)
            for _ in range(steps):
                clock.advance(0.08 / steps)
    assert 0 < clocks[0].speed < 1
    assert (clocks[0].phase, clocks[0].speed) == pytest.approx((clocks[1].phase, clocks[1].speed), rel=1e-9)


def test_a_plan_that_is_not_retimed_cannot_be_monitored():
    with pytest.raises(MmpError, match="retime it first"):
        blocked(Monitor(), plan=cornered_plan(11, 3))


def test_a_plan_at_its_limits_cannot_be_monitored():
    with pytest.raises(MmpError, match="share below 1"):
        blocked(Monitor(), plan=smooth_plan(share=1.0))


@pytest.mark.parametrize(
    "values",
    [
        {"lag_rad": 0.0},
        {"lag_rad": 0.01, "caught_up_rad": 0.02},
        {"patience_s": 0.0},
        {"lag_rad": np.inf},
        {"caught_up_rad": np.nan},
        {"patience_s": np.nan},
        {"patience_s": np.inf},
    ],
)
def test_a_monitor_with_bad_bounds_is_refused(values):
    with pytest.raises(MmpError, match="a monitor needs"):
        Monitor(**values)
