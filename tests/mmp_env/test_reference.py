"""References: where a plan has the joints between its samples, and how fast."""

import numpy as np
import pytest
from cornered_plans import cornered_plan, side_by_side
from hypothesis import given
from hypothesis import strategies as st

from mmp_env.plan import Plan
from mmp_env.reference import Reference
from mmp_env.retime import retime


def quintic_plan(seed):
    """A plan whose joints go on one polynomial of fifth degree, sampled every tenth of a second."""
    problem = cornered_plan(0, 0).problem
    times = np.linspace(0.0, 1.0, 11)
    factors = np.random.default_rng(seed).uniform(-0.2, 0.2, (6, 12))

    def rows(order, at):
        values = np.polynomial.polynomial.polyval(at, np.polynomial.polynomial.polyder(factors, order)).T
        return {name: values[:, 6 * k : 6 * k + 6] for k, name in enumerate(problem.cell.arm_names)}

    plan = Plan(
        problem=problem, times=times, positions=rows(0, times), velocities=rows(1, times), accelerations=rows(2, times)
    )
    return plan, rows


def standing(plan):
    return {name: q[0] for name, q in plan.positions.items()}


@given(seed=st.integers(0, 2**32))
def test_between_samples_with_rates_joints_go_on_a_polynomial_of_fifth_degree(seed):
    plan, rows = quintic_plan(seed)
    clock = np.linspace(0.0, 1.0, 57)
    positions, velocities = Reference(plan, standing(plan)).at(clock)
    np.testing.assert_allclose(positions, side_by_side(plan, rows(0, clock)), atol=1e-12)
    np.testing.assert_allclose(velocities, side_by_side(plan, rows(1, clock)), atol=1e-10)


def test_a_plan_without_rates_goes_straight_and_rests_after_its_end():
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
def test_a_plan_of_one_sample_is_a_place_to_stand(clock):
    problem = cornered_plan(0, 0).problem
    plan = Plan(problem=problem, times=np.zeros(1), positions={a: q[None] for a, q in problem.start.items()})
    positions, velocities = Reference(plan, problem.start).at(np.array([clock]))
    np.testing.assert_array_equal(positions[0], side_by_side(plan, problem.start))
    assert np.abs(velocities).max() == 0
