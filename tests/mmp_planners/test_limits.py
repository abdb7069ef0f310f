"""Inputs that every planner refuses before it begins, and the time of the first plan in its statistics."""

import math
import re
from contextlib import suppress

import numpy as np
import pytest
from support import two_arms
from support.unchecked import unchecked

from mmp_env import check_plan
from mmp_env.errors import MmpError
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.problems.making import make_problem
from mmp_planners import Status, describe, make, names
from mmp_planners.options import LARGEST_NUMBER, LARGEST_SEED, MOST_STEPS
from mmp_planners.portfolio.shortcutting import MOST_STEPS as MOST_STEPS_OF_A_GRID
from mmp_planners.portfolio.shortcutting import on_grid

every_planner = pytest.mark.parametrize("name", names())


def with_speed(rad_s, kind=two_arms.passing):
    """Returns a problem with this velocity limit; by default both arms turn by 1.6 rad and pass each other."""
    problem = kind()
    return make_problem(problem.cell, problem.start, problem.goal, max_velocity=rad_s)


@every_planner
def test_the_time_of_the_first_plan_is_at_most_the_planning_time(name):
    stats = make(name).plan(two_arms.passing(), seed=3, time_limit=60.0).stats
    assert type(stats["first_plan_s"]) is float
    assert 0 < stats["first_plan_s"] <= stats["planning_time_s"]


@every_planner
def test_shortening_comes_after_the_first_plan(name):
    stats = make(name, shorten=200).plan(two_arms.passing(), seed=3, time_limit=60.0).stats
    assert 0 < stats["first_plan_s"] < stats["planning_time_s"]


@every_planner
def test_without_a_plan_there_is_no_time_of_the_first_one(name):
    assert make(name).plan(two_arms.passing(), time_limit=0.0).stats["first_plan_s"] is None


@every_planner
@pytest.mark.parametrize("seed", [2**63, 2**64, 2**64 + 3])
def test_a_seed_that_is_too_large_is_refused_with_the_largest(name, seed):
    with pytest.raises(
        MmpError, match=f"^seed is {seed}; it must be a whole number, 0 or more, and {LARGEST_SEED} at most$"
    ):
        make(name).plan(two_arms.passing(), seed=seed, time_limit=60.0)


@every_planner
def test_the_largest_seed_is_one_like_any_other(name):
    result = make(name, shorten=20).plan(two_arms.passing(), seed=2**63 - 1, time_limit=60.0)
    assert result.status is Status.SOLVED
    assert result.plan.planner["seed"] == LARGEST_SEED == 2**63 - 1
    assert check_plan(result.plan).valid


@every_planner
@pytest.mark.parametrize("rad_s", [1e-9, 1.5 / MOST_STEPS / 0.1])
def test_joints_that_are_too_slow_for_the_grid_are_refused(name, rad_s):
    with pytest.raises(MmpError, match=r"arm 'left' needs \S+ steps of dt 0\.1 s to its goal.*allowed: 10000\..*low"):
        make(name).plan(with_speed(rad_s), time_limit=60.0)


@every_planner
def test_an_arm_too_slow_to_step_aside_is_refused_even_at_its_goal(name):
    """A step aside would take 10^10 steps, more than memory can hold."""
    problem = two_arms.parked_arm_between()
    speeds = {"left": [0.8] * 6, "right": [1e-9] * 6}
    slow = make_problem(problem.cell, problem.start, problem.goal, max_velocity=speeds)
    with pytest.raises(MmpError, match=r"arm 'right' needs 1e\+10 steps .* or for 1 rad"):
        make(name).plan(slow, time_limit=60.0)


@every_planner
def test_a_grid_that_is_too_fine_is_refused(name):
    with pytest.raises(MmpError, match="steps of dt 1e-06 s to its goal"):
        make(name, dt=1e-6).plan(two_arms.passing(), time_limit=60.0)


def test_a_plan_that_lasts_for_hours_is_shortened_on_a_coarser_grid():
    problem = with_speed(2 / MOST_STEPS / 0.1, two_arms.parked_arm_between)
    long = make("rrt-connect", shorten=0).plan(problem, seed=0, time_limit=60.0).plan
    result = make("rrt-connect", shorten=100).plan(problem, seed=0, time_limit=60.0)
    assert long.makespan_s > 0.1 * MOST_STEPS_OF_A_GRID
    assert len(on_grid(long, 0.1)[0]) <= MOST_STEPS_OF_A_GRID + len(long.times)
    assert result.stats["shortcuts"] > 0
    assert result.plan.cost_rad < 0.8 * long.cost_rad
    assert check_plan(result.plan).valid


@every_planner
def test_more_attempts_than_can_be_counted_are_refused(name):
    with pytest.raises(MmpError, match=f"option 'shorten' is {10**9}; it must be {LARGEST_NUMBER} at most"):
        make(name, shorten=10**9)
    make(name, shorten=LARGEST_NUMBER)


@every_planner
def test_no_option_takes_a_number_beyond_the_largest(name):
    for option in describe(name).options:
        for value in {"int": (2**70,), "float": (1e12, math.inf, math.nan)}.get(option.type, ()):
            with pytest.raises(MmpError, match=re.escape(f"option '{option.name}' is {value!r}")):
                make(name, **{option.name: value})


@every_planner
def test_every_option_takes_its_extremes_or_refuses_them(name):
    for option in describe(name).options:
        for value in {"int": (0, LARGEST_NUMBER), "float": (1e-300, 1e-12, 1e3, 1e6, LARGEST_NUMBER)}.get(
            option.type, ()
        ):
            with suppress(MmpError):
                make(name, **{option.name: value}).plan(two_arms.parked_arm_between(), seed=0, time_limit=0.02)


@every_planner
@pytest.mark.parametrize(
    ("argument", "value", "allowed"),
    [
        ("problem", None, "a Problem"),
        ("problem", "ring-2", "a Problem"),
        ("seed", "7", "a whole number, 0 or more"),
        ("seed", None, "a whole number, 0 or more"),
        ("seed", 7.0, "a whole number, 0 or more"),
        ("seed", True, "a whole number, 0 or more"),
        ("time_limit", None, "a number of seconds, 0 or more, inf for none"),
        ("time_limit", "5", "a number of seconds, 0 or more, inf for none"),
        ("time_limit", -1, "a number of seconds, 0 or more, inf for none"),
        ("time_limit", -float("inf"), "a number of seconds, 0 or more, inf for none"),
        ("time_limit", float("nan"), "a number of seconds, 0 or more, inf for none"),
    ],
)
def test_a_wrong_argument_of_a_run_is_refused_with_the_allowed_values(name, argument, value, allowed):
    given = {"problem": two_arms.passing(), "seed": 0, "time_limit": 1.0} | {argument: value}
    with unchecked(), pytest.raises(MmpError, match=f"^{argument} is {value!r}; it must be {allowed}"):
        make(name).plan(given.pop("problem"), **given)


@every_planner
def test_numbers_of_numpy_are_seed_and_time_limit(name):
    with unchecked():
        one, other = (
            make(name).plan(two_arms.passing(), seed=seed, time_limit=limit)
            for seed, limit in ((3, 60.0), (np.int64(3), np.float32(60.0)))
        )
    assert plan_to_dict(one.plan) == plan_to_dict(other.plan)
