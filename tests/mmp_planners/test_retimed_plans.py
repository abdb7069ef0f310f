"""Plans of planners, retimed and executed: valid, hardly longer, and followed closely."""

import functools

import gymnasium
import pytest

import mmp_env  # noqa: F401  registers the environments
import mmp_planners
from mmp_env import check_plan
from mmp_env.retime import retime_with_report

CASES = [
    ("MultiArmCell-8", {}, "auto", 4),
    ("MultiArmCell-4", {"robot": "panda"}, "auto", 1),
    ("MultiArmCell-4", {"robot": "piper"}, "prioritized", 2),
    ("MultiArmCell-4", {"robot": "fr5"}, "auto", 2),
    ("MultiArmCell-4", {}, "ecbs", 3),
]


@functools.cache
def retimed(case):
    environment, options, planner, seed = CASES[case]
    env = gymnasium.make(environment, **options).unwrapped
    env.reset(seed=seed)
    plan = mmp_planners.make(planner).plan(env.problem, seed=seed).plan
    return env, *retime_with_report(plan)


@pytest.mark.parametrize("case", range(len(CASES)))
def test_a_retimed_plan_is_valid_for_the_independent_checker_and_hardly_longer(case):
    _, plan, report = retimed(case)
    assert check_plan(plan).violations == ()
    assert report.corners > 0
    assert report.ratio < 1.5


@pytest.mark.parametrize("case", range(len(CASES)))
def test_the_arms_follow_a_retimed_plan_within_a_milliradian_and_keep_its_clearance(case):
    env, plan, _ = retimed(case)
    report = env.execute(plan)
    assert report.reached
    assert report.contacts == []
    assert report.max_tracking_error_rad < 1e-3
    assert report.nearness.planned_m >= plan.problem.margin
    assert report.nearness.closer_m == 0
