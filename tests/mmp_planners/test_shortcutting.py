"""Shortcutting as a part of planners."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import two_arms

import mmp_planners
from mmp_env import check_plan, core
from mmp_env.check.reading import read_plan
from mmp_env.check.rules import ends, limits, speed, times
from mmp_env.events import NodeCreated, SolutionFound
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.gym.instances import draw_instance
from mmp_env.model.certificate import certify
from mmp_env.model.plan import Plan
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners.portfolio import run as run_module
from mmp_planners.portfolio.improve import shorten
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.shortcutting import Shortcutting, on_grid, retime_to_velocity_limits

WAIT = np.array([0, 0, 1, 1])
"""Two rows at the start and two at the goal, so both arms wait before and after."""


def ring(arms=4, seed=2):
    cell = ring_cell(arms)
    return make_problem(cell, *draw_instance(cell, seed=seed))


@pytest.mark.parametrize("planner", ["rrt-connect", "prioritized", "apf-ecbs"])
def test_a_shortened_plan_costs_no_more_and_passes_the_checker(planner):
    problem = ring()
    long = mmp_planners.make(planner, shorten=0).plan(problem, seed=1)
    short = mmp_planners.make(planner, shorten=300).plan(problem, seed=1)
    assert short.plan.cost_rad <= long.plan.cost_rad + 1e-9
    assert check_plan(short.plan).valid
    assert short.stats["cost_rad"] == pytest.approx(short.plan.cost_rad)


def test_a_plan_that_is_shortened_to_the_bound_meets_it():
    options = {"bound": "straight", "w": 1.05}
    found = mmp_planners.make("apf-ecbs", **options).plan(ring(), seed=2).stats
    short = mmp_planners.make("apf-ecbs", **options, shorten=400).plan(ring(), seed=2).stats
    assert (found["cost_ratio"] <= 1.05, found["bound_met"]) == (False, False)
    assert (short["cost_ratio"] <= 1.05, short["bound_met"]) == (True, True)


@pytest.mark.parametrize("planner", ["rrt-connect", "prioritized", "apf-ecbs"])
def test_the_shortened_plan_is_emitted_as_a_child_of_the_plan_as_found(planner):
    events = []
    plan = mmp_planners.make(planner, shorten=300).plan(ring(), seed=3, watch=events.append).plan
    found, shortened = (event for event in events if isinstance(event, SolutionFound))
    nodes = {event.node: event for event in events if isinstance(event, NodeCreated)}
    assert nodes[shortened.node].parent == found.node
    assert len(nodes) == sum(isinstance(event, NodeCreated) for event in events), "each has a number of its own"
    assert shortened.cost_rad == plan.cost_rad < found.cost_rad


@pytest.mark.parametrize("planner", ["rrt-connect", "prioritized", "apf-ecbs"])
def test_a_plan_at_which_a_watcher_stops_the_run_is_not_shortened(planner):
    def stop(event):
        if isinstance(event, SolutionFound):
            raise mmp_planners.StopPlanning

    stopped = mmp_planners.make(planner, shorten=300).plan(ring(), seed=3, watch=stop)
    found = mmp_planners.make(planner, shorten=0).plan(ring(), seed=3)
    assert stopped.stats["shortcuts"] == 0
    assert stopped.plan.cost_rad == found.plan.cost_rad


def test_composite_plans_become_much_shorter():
    problem = ring(6, 4)
    long = mmp_planners.make("rrt-connect", shorten=0).plan(problem, seed=0)
    short = mmp_planners.make("rrt-connect").plan(problem, seed=0)
    assert short.stats["shortcuts"] > 0
    assert short.stats["cost_ratio"] < 1.1 < long.stats["cost_ratio"]


def test_steps_take_as_long_as_their_slowest_joint_and_no_longer():
    problem = two_arms.passing()
    rows = [
        np.array([problem.start[n], (problem.start[n] + problem.goal[n]) / 2, problem.goal[n]])
        for n in problem.cell.arm_names
    ]
    plan = retime_to_velocity_limits(problem, rows)
    np.testing.assert_allclose(plan.times, [0.0, 1.0, 2.0], atol=1e-9)  # 0.8 rad each at 0.8 rad/s


def test_steps_in_which_nothing_moves_are_left_out():
    problem = two_arms.passing()
    rows = [np.array([problem.start[n]] * 3 + [problem.goal[n]] * 3) for n in problem.cell.arm_names]
    plan = retime_to_velocity_limits(problem, rows)
    assert len(plan.times) == 2
    np.testing.assert_array_equal(plan.positions["left"], [problem.start["left"], problem.goal["left"]])


def test_arms_that_never_move_have_a_plan_of_no_length():
    problem = two_arms.nothing_to_do()
    plan = retime_to_velocity_limits(problem, [np.array([problem.start[n]] * 4) for n in problem.cell.arm_names])
    assert plan.makespan_s == 0
    assert plan.cost_rad == 0


def anywhere(seed):
    """Returns a problem with room for both arms, from one random state to another."""
    rng = np.random.default_rng(seed)
    ends = [{name: two_arms.reaching(1.3) + rng.uniform(-0.2, 0.2, 6) for name in ("left", "right")} for _ in "ab"]
    return make_problem(two_arms.facing_cell(), *ends), rng


def assert_exact(plan, problem):
    """Checks exact ends, ascending times, joint limits and velocity limits."""
    for name in problem.cell.arm_names:
        np.testing.assert_array_equal(plan.positions[name][0], problem.start[name])
        np.testing.assert_array_equal(plan.positions[name][-1], problem.goal[name])
    data = read_plan(plan_to_dict(plan))
    assert not [violation for rule in (times, ends, limits, speed) for violation in rule(data)]


def waiting(seed):
    """Returns rows in single precision, as the core returns them. Its start and goal differ by rounding."""
    problem, rng = anywhere(seed)
    rows = []
    for name in problem.cell.arm_names:
        there = problem.goal[name] - problem.start[name]
        fractions = np.concatenate([[0, 0], np.sort(rng.uniform(0, 1, 3)), [1, 1, 1]])
        rows.append((problem.start[name] + fractions[:, None] * there).astype(np.float32).astype(float))
    return problem, rows


@given(seed=st.integers(0, 2**32))
def test_plans_that_end_in_waits_of_all_arms_keep_every_limit(seed):
    problem, rows = waiting(seed)
    plan = retime_to_velocity_limits(problem, rows)
    assert len(plan.times) < len(rows[0])
    assert_exact(plan, problem)


@pytest.mark.parametrize("seed", range(5))
def test_plans_that_end_in_waits_of_all_arms_pass_the_checker(seed):
    problem, rows = waiting(seed)
    report = check_plan(retime_to_velocity_limits(problem, rows))
    assert report.valid, report


@given(seed=st.integers(0, 2**32), turns=st.integers(1, 300))
def test_the_tiny_last_step_of_a_long_plan_is_not_too_fast(seed, turns):
    """The step takes nanoseconds after minutes, so rounding of the times matters."""
    problem, rng = anywhere(seed)
    hairs = rng.uniform(1e-9, 1e-7, 4)
    rows = []
    for name in problem.cell.arm_names:
        there = problem.goal[name] - problem.start[name]
        fractions = np.concatenate([np.arange(2 * turns) % 2, 1 - np.cumsum(hairs)[::-1], [1.0]])
        rows.append(problem.start[name] + fractions[:, None] * there)
    assert_exact(retime_to_velocity_limits(problem, rows), problem)


def test_a_single_row_becomes_the_straight_path_or_no_plan():
    for problem, expected in ((two_arms.one_moves(), 0.5), (two_arms.nothing_to_do(), 0.0)):
        plan = retime_to_velocity_limits(problem, [problem.start[name][None] for name in problem.cell.arm_names])
        assert len(plan.times) == (2 if expected else 1)
        assert plan.makespan_s == pytest.approx(expected)
        assert_exact(plan, problem)


def test_the_given_rows_are_not_changed():
    problem = two_arms.one_moves()
    rows = [np.vstack([problem.start[n], problem.goal[n]])[WAIT] + 1e-8 for n in problem.cell.arm_names]
    before = [r.copy() for r in rows]
    plan = retime_to_velocity_limits(problem, rows)
    np.testing.assert_array_equal(rows, before)
    assert_exact(plan, problem)


def test_a_grid_has_every_corner_of_the_plan():
    problem = two_arms.passing()
    times = np.array([0.0, 0.25, 0.31, 2.5])
    q = {
        n: np.array([problem.start[n], problem.start[n] + 0.01, problem.start[n] - 0.01, problem.goal[n]])
        for n in problem.cell.arm_names
    }
    rows = on_grid(Plan(problem=problem, times=times, positions=q), 0.1)
    for name, grid in zip(problem.cell.arm_names, rows, strict=True):
        assert len(grid) == 1 + 3 + 1 + 22
        np.testing.assert_allclose(grid[[0, 3, 4, -1]], q[name])


def test_an_arm_in_a_group_of_its_own_becomes_straight():
    problem = two_arms.parked_arm_between()
    plan = mmp_planners.make("rrt-connect", shorten=0).plan(problem, seed=0).plan
    (among, _), (alone, kept) = (
        Shortcutting(attempts=300)(plan, 0, core.Clock(math.inf), groups=groups) for groups in (None, range(2))
    )
    assert kept > 0
    assert check_plan(among).valid
    assert not certify(alone, core.Clock(math.inf)).valid
    assert alone.cost_rad == pytest.approx(problem.cost_lower_bound_rad, abs=2e-3)


def test_rounds_repeat_while_they_save_enough():
    plan = mmp_planners.make("rrt-connect", shorten=0).plan(ring(6, 4), seed=0).plan
    once, again = (
        Shortcutting(attempts=20, repeat_gain=worth)(plan, 0, core.Clock(math.inf))[0] for worth in (10, 1e-3)
    )
    assert again.cost_rad < 0.95 * once.cost_rad
    by_default = Shortcutting(attempts=20)(plan, 0, core.Clock(math.inf))[0]
    assert plan_to_dict(by_default) == plan_to_dict(once)


def test_a_cancelled_clock_leaves_the_plan():
    problem = ring()
    plan = mmp_planners.make("rrt-connect").plan(problem, seed=0).plan
    clock = core.Clock(math.inf)
    clock.cancel()
    found, kept = Shortcutting(attempts=100_000)(plan, 0, clock)
    assert kept < 10
    assert found.cost_rad <= plan.cost_rad + 1e-9


def test_shortcuts_found_before_the_deadline_are_kept(monkeypatch):
    monkeypatch.setattr(run_module, "LEAST_PROOF_S", 1.5)  # enough time for the proof on a busy machine
    monkeypatch.setattr(run_module, "PROOF_SHARE", 0.5)
    problem = two_arms.parked_arm_between()
    long = mmp_planners.make("rrt-connect", shorten=0).plan(problem, seed=0)
    short = mmp_planners.make("rrt-connect", shorten=10**8).plan(problem, seed=0, time_limit=3.0)
    assert short.stats["deadline_hit"]
    assert short.stats["shortcuts"] > 0
    assert short.stats["cost_ratio"] < 0.7 * long.stats["cost_ratio"]
    assert check_plan(short.plan).valid


def test_shortcuts_without_time_for_a_proof_are_dropped(monkeypatch):
    """The clock expires between the last shortcut and the proof, so the earlier proved plan is returned."""
    problem = two_arms.passing()
    run = Run.begin("rrt-connect", None, problem, 0, math.inf)
    assert run.offer(mmp_planners.make("rrt-connect").plan(problem, seed=0).plan)
    proved = run.best

    def too_late(plan, clock):
        clock.cancel()
        return certify(plan, clock)

    monkeypatch.setattr(run_module, "certify", too_late)
    assert not shorten(run, 200, 0.1)
    assert run.best is proved
    assert (run.counts.shortcuts, run.counts.failed_certificates) == (0, 0)
