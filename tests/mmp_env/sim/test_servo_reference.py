"""References: positions and velocities of a plan between its samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.cornered_plans import cornered_plan, side_by_side

from mmp_env.model.plan import Plan
from mmp_env.retime import retime
from mmp_env.sim.servo_reference import Reference


def random_motion(seed, *, times=None):
    """Returns a plan with velocities and accelerations, whose samples are random."""
    problem = cornered_plan(0, 0).problem
    times = np.linspace(0.0, 1.0, 11) if times is None else times
    rng = np.random.default_rng(seed)
    rows = [{name: rng.uniform(-1, 1, (len(times), 6)) for name in problem.cell.arm_names} for _ in range(3)]
    return Plan(problem=problem, times=times, positions=rows[0], velocities=rows[1], accelerations=rows[2])


def standing(plan):
    return {name: q[0] for name, q in plan.positions.items()}


def differences(q, step, order):
    """Returns the largest difference of each joint, at rest before and after."""
    rows = np.pad(q, ((order, order), (0, 0)), mode="edge")
    return np.abs(np.diff(rows, n=order, axis=0)).max(axis=0) / step**order


@given(seed=st.integers(0, 2**32), rate=st.sampled_from([37.0, 250.0, 2000.0]))
def test_a_spline_keeps_the_limits_of_its_samples_between_them(seed, rate):
    plan = random_motion(seed)
    reference, q = Reference(plan, standing(plan)), side_by_side(plan, plan.positions)
    dense, _ = reference.at(np.arange(reference.start_s, reference.end_s + 1 / rate, 1 / rate))
    for order in (1, 2, 3):
        most = differences(q, plan.times[1], order)
        assert (differences(dense, 1 / rate, order) <= most * (1 + 1e-6)).all()


@given(seed=st.integers(0, 2**32))
def test_a_spline_has_the_ends_of_its_plan_and_stays_between_its_samples(seed):
    plan = random_motion(seed)
    reference, q = Reference(plan, standing(plan)), side_by_side(plan, plan.positions)
    assert (reference.start_s, reference.end_s) == pytest.approx((-0.1, 1.1))
    ends, rates = reference.at(np.array([-5.0, reference.start_s, reference.end_s, 5.0]))
    np.testing.assert_allclose(ends, q[[0, 0, -1, -1]], atol=1e-12)
    assert np.abs(rates).max() < 1e-12
    inside = np.diff(np.pad(q, ((1, 1), (0, 0)), mode="edge"), n=2, axis=0) / 6
    np.testing.assert_allclose(reference.at(plan.times)[0], q + inside, atol=1e-12)


@given(seed=st.integers(0, 2**32))
def test_velocities_of_a_spline_are_derivatives_of_its_positions(seed):
    reference, h = Reference(plan := random_motion(seed), standing(plan)), 1e-5
    clock = np.linspace(-0.09, 1.09, 57)
    after, before = (reference.at(clock + d)[0] for d in (h, -h))
    np.testing.assert_allclose((after - before) / (2 * h), reference.at(clock)[1], atol=1e-5)


@given(seed=st.integers(0, 2**32))
def test_the_pieces_of_a_spline_have_tight_bounds(seed):
    reference = Reference(plan := random_motion(seed), standing(plan))
    pieces, h = reference.pieces(), 5e-3
    assert len(pieces.velocity) == 12
    for k in range(12):
        q, _ = reference.at(pieces.start_s + pieces.step_s * np.linspace(k, k + 1, 21))
        for order, bound in ((1, pieces.velocity), (2, pieces.acceleration), (3, pieces.jerk)):
            assert (np.abs(np.diff(q, n=order, axis=0)).max(axis=0) / h**order <= bound[k] * (1 + 1e-6) + 1e-6).all()


def test_a_plan_with_unequal_steps_is_linear_with_its_stated_velocities():
    plan = random_motion(1, times=np.array([0.0, 0.1, 0.4]))
    reference = Reference(plan, standing(plan))
    assert not reference.is_smooth
    positions, velocities = reference.at(np.array([0.05, 0.1]))
    q, v = side_by_side(plan, plan.positions), side_by_side(plan, plan.velocities)
    np.testing.assert_allclose(positions, [(q[0] + q[1]) / 2, q[1]], atol=1e-12)
    np.testing.assert_allclose(velocities, [(v[0] + v[1]) / 2, v[1]], atol=1e-12)


def test_a_plan_without_velocities_is_linear_and_rests_after_its_end():
    plan = cornered_plan(1, 2)
    reference = Reference(plan, standing(plan))
    clock = np.array([0.0, 0.3 * plan.times[1], plan.times[1], plan.makespan_s, plan.makespan_s + 1.0])
    positions, velocities = reference.at(clock)
    for row, t in zip(positions, clock, strict=True):
        np.testing.assert_allclose(row, side_by_side(plan, plan.at(t)), atol=1e-12)
    first = (positions[2] - positions[0]) / plan.times[1]
    np.testing.assert_allclose(velocities[:2], [first, first], atol=1e-9)
    assert np.abs(velocities[3:]).max() == 0


def test_arms_that_a_plan_does_not_move_stand_still():
    plan = retime(cornered_plan(1, 1))
    others = {"left": plan.positions["left"], "right": np.full(6, 0.5)}
    alone = Plan(
        problem=plan.problem,
        times=plan.times,
        positions={"left": plan.positions["left"]},
        velocities={"left": plan.velocities["left"]},
        accelerations={"left": plan.accelerations["left"]},
    )
    positions, velocities = Reference(alone, others | {"left": others["left"][0]}).at(np.linspace(0, 1, 7))
    assert (positions[:, 6:] == 0.5).all()
    assert np.abs(velocities[:, 6:]).max() == 0
    assert np.abs(velocities[:, :6]).max() > 0.1


@pytest.mark.parametrize("clock", [0.0, 0.5])
def test_a_plan_of_one_sample_stands_still(clock):
    problem = cornered_plan(0, 0).problem
    plan = Plan(problem=problem, times=np.zeros(1), positions={a: q[None] for a, q in problem.start.items()})
    positions, velocities = Reference(plan, problem.start).at(np.array([clock]))
    np.testing.assert_array_equal(positions[0], side_by_side(plan, problem.start))
    assert np.abs(velocities).max() == 0
