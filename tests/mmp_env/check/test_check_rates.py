"""Retimed plans: the checker's rules for velocities, accelerations and jerk."""

from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import tiny_plans
from support.tiny_plans import UPRIGHT

from mmp_env import check_plan
from mmp_env.check.checked import CheckedPlan
from mmp_env.check.rates import difference_times, divided_differences
from mmp_env.check.rules import exceeded, largest_moves

TURN_RAD, DURATION_S, RATE_HZ = 0.4, 1.5, 250
ACCELERATION = 10 / np.sqrt(3) * TURN_RAD / DURATION_S**2
JERK = 60 * TURN_RAD / DURATION_S**3


def smooth(times=None, **limits):
    """Returns a quintic from rest to rest, whose largest acceleration and jerk are known."""
    if times is None:
        times = np.linspace(0.0, DURATION_S, int(DURATION_S * RATE_HZ) + 1)
    s = np.minimum(times / DURATION_S, 1.0)
    move = np.eye(6)[0] * TURN_RAD
    columns = {
        "positions": 10 * s**3 - 15 * s**4 + 6 * s**5,
        "velocities": (30 * s**2 - 60 * s**3 + 30 * s**4) / DURATION_S,
        "accelerations": (60 * s - 180 * s**2 + 120 * s**3) / DURATION_S**2,
    }
    rows = {key: column[:, None] * move for key, column in columns.items()}
    rows["positions"] = rows["positions"] + UPRIGHT
    plan = tiny_plans.plan(
        [tiny_plans.arm("arm", [0.0, 0.0, 0.0])],
        {"arm": rows.pop("positions").tolist()},
        times=times.tolist(),
        **{key: {"arm": values.tolist()} for key, values in rows.items()},
    )
    plan["problem"] |= {"max_acceleration": 1.001 * ACCELERATION, "max_jerk": 1.001 * JERK} | limits
    return plan


def broken(plan):
    return {violation.rule for violation in check_plan(plan).violations}


def test_a_smooth_plan_within_its_limits_is_valid():
    assert broken(smooth()) == set()


def test_a_last_step_that_is_shorter_than_the_others_is_no_violation():
    times = np.append(np.arange(0.0, DURATION_S, 1 / RATE_HZ), DURATION_S - 1e-7)
    assert broken(smooth(np.append(times, DURATION_S))) == set()


@pytest.mark.parametrize("each_joint", [False, True])
def test_an_acceleration_above_the_limit_is_a_violation(each_joint):
    limit = 0.98 * ACCELERATION
    plan = smooth(max_acceleration={"arm": [limit] * 6} if each_joint else limit)
    report = check_plan(plan)
    assert {violation.rule for violation in report.violations} == {"acceleration", "rates"}
    found = report.violations[0]
    assert found.values["joint"] == 1
    assert found.values["value"] == pytest.approx(ACCELERATION, rel=1e-3)


def test_a_jerk_above_the_limit_is_a_violation():
    report = check_plan(smooth(max_jerk=0.95 * JERK))
    assert [violation.rule for violation in report.violations] == ["jerk", "rates"]
    assert report.violations[0].values["value"] == pytest.approx(JERK, rel=0.05)  # a mean over three steps


def test_a_start_with_a_jolt_breaks_the_limits_though_every_stated_rate_keeps_them():
    plan = smooth()
    for key in ("positions", "velocities", "accelerations"):
        plan[key]["arm"] = plan[key]["arm"][60:]
    plan["times"] = plan["times"][: len(plan["positions"]["arm"])]
    plan["problem"]["start"]["arm"] = plan["positions"]["arm"][0]
    assert {"acceleration", "jerk"} <= broken(plan)


def test_a_polyline_with_an_acceleration_limit_is_a_violation():
    plan = tiny_plans.two_apart()
    plan["problem"]["max_acceleration"] = 1.0
    assert broken(plan) == {"acceleration"}


@pytest.mark.parametrize(
    ("what", "row", "add"), [("velocities", 100, 0.05), ("velocities", 0, 0.1), ("accelerations", 100, 0.5)]
)
def test_rates_that_do_not_fit_the_positions_are_a_violation(what, row, add):
    plan = smooth()
    plan[what]["arm"][row][2] += add
    assert broken(plan) == {"rates"}


@pytest.mark.parametrize("factor", [-1.0, 0.0, 0.9, 1.1, 2.0])
@pytest.mark.parametrize("what", ["velocities", "accelerations"])
def test_rates_of_another_sign_or_scale_are_a_violation(what, factor):
    plan = smooth()
    plan[what]["arm"] = (factor * np.array(plan[what]["arm"])).tolist()
    assert "rates" in broken(plan)


def test_a_rate_that_differs_from_the_positions_is_reported_in_its_unit():
    plan = smooth()
    plan["velocities"]["arm"][100][2] += 0.05
    found = check_plan(plan).violations[0]
    step = DURATION_S / int(DURATION_S * RATE_HZ)
    assert found.values["unit"] == "rad/s"
    assert found.values["value"] == pytest.approx(0.025)
    assert found.values["allowed"] == pytest.approx(1.001 * JERK * step**2 / 12)
    assert "joint 3, states velocities off those of its motion by 0.025 rad/s; allowed: " in found.message


def test_accelerations_without_velocities_are_a_violation():
    plan = smooth()
    plan["velocities"] = None
    assert broken(plan) == {"schema"}


def test_a_stated_velocity_above_the_limit_is_a_violation():
    plan = smooth()
    plan["problem"]["max_velocity"] = 0.9 * 1.875 * TURN_RAD / DURATION_S
    assert broken(plan) == {"speed", "rates"}


def test_rates_of_a_wrong_shape_are_a_violation():
    plan = smooth()
    plan["velocities"]["arm"].pop()
    assert broken(plan) == {"shape"}


def test_rates_that_are_no_numbers_are_a_violation():
    plan = smooth()
    plan["accelerations"]["arm"][3][3] = np.nan
    assert broken(plan) == {"finite"}


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32), order=st.sampled_from([2, 3]))
def test_divided_differences_never_exceed_the_derivative_of_a_motion(seed, order):
    """The motions are quintics from rest to rest, sampled at uneven times."""
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.0005, 0.01, 300))])
    s = times / times[-1]
    q = np.outer(10 * s**3 - 15 * s**4 + 6 * s**5, rng.uniform(-1.0, 1.0, 3))
    most = {2: 10 / np.sqrt(3), 3: 60.0}[order] * np.abs(q[-1]) / times[-1] ** order
    rate, at = divided_differences(times, q, order), difference_times(times, order)
    assert (rate <= most * (1 + 1e-9)).all()
    assert rate.max() > 0.8 * most.max()
    assert at[0] == 0.0
    assert len(at) == len(rate)


def test_every_joint_of_a_large_cell_is_looked_at():
    plan = Mock(spec=CheckedPlan, joints=[("arm", k + 1) for k in range(70)], units=["rad"] * 70)
    rate, limit, at = np.full((5, 70), 0.5), np.ones(70), np.arange(5.0)
    rate[3, 50] = -1.5
    found = list(exceeded(plan, "speed", "moves at", "/s", lambda some: (rate[:, some], limit[some]), at, 1e-9))
    assert [(v.time_s, v.values["joint"], v.values["value"]) for v in found] == [(3.0, 51, 1.5)]
    q = np.random.default_rng(0).normal(size=(20, 70))
    np.testing.assert_array_equal(largest_moves(q), np.abs(np.diff(q, axis=0)).max(axis=1))
