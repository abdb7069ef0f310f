"""The execution monitor: all arms stop on the common phase when one lags, within limits, and go on after."""

import functools

import numpy as np
import pytest
from cornered_plans import cornered_plan, side_by_side
from hypothesis import given, settings
from hypothesis import strategies as st

from mmp_env.env import MultiArmCellEnv
from mmp_env.errors import MmpError
from mmp_env.execution import execute_plan
from mmp_env.monitor import Monitor
from mmp_env.phase_clock import PhaseClock
from mmp_env.reference import Reference
from mmp_env.retime import retime
from mmp_env.simulation import Simulation

STEP_S = 0.002
BLOCKED_S = (0.5, 1.6)


@functools.cache
def smooth_plan(*, share=0.9):
    return retime(cornered_plan(11, 3), share=share)


def reference_of(plan):
    return Reference(plan, {name: q[0] for name, q in plan.positions.items()})


@functools.cache
def blocked(monitor, until_s=BLOCKED_S[1], plan=None):
    """An execution in which the second joint of the left arm is held as if in thick tar for a while."""
    plan = plan or smooth_plan()
    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    joint = simulation.slices["left"].start + 1

    def tar():
        held = BLOCKED_S[0] <= simulation.data.time < until_s
        simulation.model.dof_damping[joint] = 1e6 if held else 0.0

    return execute_plan(simulation, plan, tar, monitor)


def test_an_arm_that_is_held_stops_all_and_they_go_on_when_it_has_caught_up():
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


def test_stopping_and_going_on_keep_the_limits_of_every_joint():
    report = blocked(Monitor(lag_rad=0.01))
    plan = smooth_plan()
    rate, _ = reference_of(plan).at(report.phases)
    # Between samples a polynomial may overshoot a velocity that jumps in acceleration by a hair.
    for limits, slack in ((plan.problem.max_velocity, 1e-3), (plan.max_acceleration, 1e-6), (plan.max_jerk, 1e-6)):
        rate = np.diff(rate, axis=0) / STEP_S
        assert (np.abs(rate) <= side_by_side(plan, limits) * (1 + slack)).all()


def test_an_execution_without_lag_is_the_same_with_a_monitor():
    env = MultiArmCellEnv(cell=smooth_plan().problem.cell)
    with_it, without = (env.execute(smooth_plan(), monitor=monitor) for monitor in (Monitor(), None))
    assert with_it.halts == without.halts == []
    assert with_it.max_tracking_error_rad == pytest.approx(without.max_tracking_error_rad, rel=1e-2)
    assert with_it.max_tracking_error_rad < 1e-3
    np.testing.assert_allclose(with_it.phases, without.phases, atol=1e-9)


def test_patience_comes_to_an_end():
    report = blocked(Monitor(lag_rad=0.01, patience_s=0.5), until_s=np.inf)
    assert not report.reached
    assert report.halts[-1].until_s is None
    assert report.phases[-1] < smooth_plan().makespan_s
    assert report.duration_s < 3


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32), turns=st.lists(st.floats(0.01, 0.6), max_size=6))
def test_however_often_the_phase_is_turned_it_keeps_limits_and_never_goes_back(seed, turns):
    plan = retime(cornered_plan(seed, 3))
    reference = reference_of(plan)
    clock, phases = PhaseClock(reference), [0.0]
    for k, lasting in enumerate([*turns, np.inf]):
        clock.turn(1.0 if lasting == np.inf else float(k % 2))
        end = len(phases) + lasting / STEP_S
        while len(phases) < end and not clock.over:
            clock.advance(STEP_S)
            phases.append(clock.phase)
    phases = np.array(phases)
    assert (np.diff(phases) >= 0).all()
    assert (np.diff(phases) <= STEP_S * (1 + 1e-9)).all()
    rate, _ = reference.at(phases)
    for limits, slack in ((plan.problem.max_velocity, 1e-3), (plan.max_acceleration, 1e-2), (plan.max_jerk, 1e-2)):
        rate = np.diff(rate, axis=0) / STEP_S
        assert (np.abs(rate) <= side_by_side(plan, limits) * (1 + slack)).all()


def test_a_plan_that_is_not_retimed_cannot_be_monitored():
    with pytest.raises(MmpError, match="retime it first"):
        blocked(Monitor(), plan=cornered_plan(11, 3))


def test_a_plan_at_its_limits_cannot_be_monitored():
    with pytest.raises(MmpError, match="share below 1"):
        blocked(Monitor(), plan=smooth_plan(share=1.0))


@pytest.mark.parametrize("values", [{"lag_rad": 0.0}, {"lag_rad": 0.01, "caught_up_rad": 0.02}, {"patience_s": 0.0}])
def test_a_monitor_with_bounds_that_make_no_sense_is_refused(values):
    with pytest.raises(MmpError, match="a monitor needs"):
        Monitor(**values)
