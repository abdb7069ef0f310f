"""Path recombination, as `auto` uses it after shortcuts and LNS."""

import contextlib
import math

import numpy as np
import pytest
from support import two_arms
from support.path_pools import lifted, mutually_blocking, path_pool
from support.path_pools import run as run_of

import mmp_planners
from mmp_env import check_plan, core
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.gym.instances import draw_instance
from mmp_env.model.certificate import certify
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners import Status
from mmp_planners.portfolio import path_recombination
from mmp_planners.portfolio.improve import Step, improve
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.path_recombination import GAIN_RAD, MOST_STEPS, PathRecombination
from mmp_planners.portfolio.run import Run
from mmp_planners.portfolio.shortcutting import Shortcutting, retime_to_velocity_limits

OPTIONS = {"shorten": 20, "rounds": 4, "replan": 0}
ALONE = Shortcutting(attempts=300, dt=0.2)


def crowded(seed=5):
    cell = ring_cell(6, "panda")
    return make_problem(cell, *draw_instance(cell, seed=seed))


def begun(problem):
    """Returns a run with the plan of the composite search as it was found."""
    run = Run.begin("auto", None, problem, 0, math.inf)
    assert run.offer(mmp_planners.make("rrt-connect", shorten=0).plan(problem, seed=0).plan)
    return run


def pool_of(run):
    return PathRecombination(run, run.best.plan, 0.1, Shortcutting(attempts=20, dt=0.2), ALONE)


def recombine(run, orders=1, turn=1, calls=1):
    """Returns the result of the last of `calls` calls: groups of arms first, then orders, and so on."""
    part = pool_of(run)
    return [part(run.best.plan, orders, turn + k) for k in range(calls)][-1]


@pytest.mark.parametrize("seed", [3, 6])
def test_a_crowded_cell_is_recombined_and_the_rounds_that_helped_are_counted(monkeypatch, seed):
    problem = crowded(seed)
    result = mmp_planners.make("auto", **OPTIONS).plan(problem, seed=0)
    assert result.stats["recombined"] > 0
    assert check_plan(result.plan).valid
    monkeypatch.setattr(PathRecombination, "__call__", lambda *_: None)
    without = mmp_planners.make("auto", **OPTIONS).plan(problem, seed=0)
    assert without.stats["recombined"] == 0
    assert result.plan.cost_rad < without.plan.cost_rad


def test_the_same_seed_gives_the_same_recombined_plan():
    problem = crowded()
    first, second = (plan_to_dict(mmp_planners.make("auto", **OPTIONS).plan(problem, seed=0).plan) for _ in range(2))
    assert first == second


@pytest.mark.parametrize(("orders", "calls"), [(1, 1), (0, 2), (1, 2), (4, 2)])
def test_a_recombined_plan_is_shorter_than_the_best_plan_and_does_not_replace_it(orders, calls):
    run = begun(crowded())
    before = run.best
    plan = recombine(run, orders, calls=calls)
    assert plan.cost_rad < before.cost - GAIN_RAD + 1e-6
    assert certify(plan, core.Clock(math.inf)).valid
    assert run.best is before


def test_every_turn_has_a_seed_of_its_own():
    run = begun(crowded())
    first, again, other = (plan_to_dict(recombine(run, turn=turn)) for turn in (1, 1, 2))
    assert first == again
    assert first != other


def around_each_other():
    """Returns a problem in which each arm's goal blocks the other arm, so one arm must lift its hand."""
    problem = mutually_blocking()
    run = Run.begin("auto", None, problem, 0, math.inf)
    assert run.offer(retime_to_velocity_limits(problem, run_of(path_pool(problem, lifted(problem, 1.4)))))
    return run


def note_groups(monkeypatch, *, allowed=()):
    """Returns a list that gets each planned group and its method. Methods that are not `allowed` find no path."""
    asked = []
    for name in ("_plan_together", "_plan_in_order"):
        method = getattr(PathRecombination, name)

        def noted(part, members, *rest, name=name, method=method):
            asked.append((name, set(members)))
            return method(part, members, *rest) if name in allowed else None

        monkeypatch.setattr(PathRecombination, name, noted)
    return asked


@pytest.mark.parametrize(("method", "calls"), [("_plan_together", 1), ("_plan_in_order", 3)])
def test_mutually_blocking_arms_are_planned_as_a_group(monkeypatch, method, calls):
    run, asked = around_each_other(), note_groups(monkeypatch, allowed=[method])
    monkeypatch.setattr(PathRecombination, "_try_orders", lambda *_: None)
    plan = recombine(run, calls=calls)
    assert asked[-1] == (method, {0, 1})
    assert plan.cost_rad < run.best.cost - GAIN_RAD + 1e-6
    assert certify(plan, core.Clock(math.inf)).valid


def test_a_group_without_paths_leaves_the_pool_as_it_is(monkeypatch):
    run = around_each_other()
    asked = note_groups(monkeypatch)
    assert recombine(run) is None
    assert asked


def test_arms_that_block_no_other_arm_are_in_no_group(monkeypatch):
    run, asked = begun(crowded()), note_groups(monkeypatch, allowed=["_plan_together"])
    recombine(run)
    assert asked
    assert all(1 < len(arms) < 6 for _, arms in asked)


def test_a_shortest_plan_is_not_recombined():
    problem = two_arms.one_moves()
    run = Run.begin("auto", None, problem, 0, math.inf)
    assert run.offer(
        retime_to_velocity_limits(
            problem, [np.vstack([problem.start[n], problem.goal[n]]) for n in problem.cell.arm_names]
        )
    )
    assert recombine(run) is None


def test_a_long_plan_has_a_coarser_grid(monkeypatch):
    """A coordination diagram has the product of two arms' steps."""
    made, steps = path_recombination.core.PathRecombination, []

    def noted(cell, max_step, levels):
        steps.append(max_step[0] / problem.max_velocity["left"])
        return made(cell, max_step, levels)

    monkeypatch.setattr(path_recombination.core, "PathRecombination", noted)
    problem = two_arms.passing()
    run = Run.begin("auto", None, problem, 0, math.inf)
    for times in (1, 400):
        rows = [np.vstack([[problem.start[n], problem.goal[n]] * times]) for n in problem.cell.arm_names]
        first = retime_to_velocity_limits(problem, rows)
        PathRecombination(run, first, 0.1, ALONE, ALONE)
        np.testing.assert_allclose(steps.pop(), max(0.1, first.makespan_s / MOST_STEPS))
    assert first.makespan_s > 10 * 0.1 * MOST_STEPS


def test_a_run_whose_time_is_up_while_it_recombines_ends_with_the_plan_that_it_has(monkeypatch):
    turns = []

    begin = PathRecombination.__init__

    def late(self, run, *rest):
        """Spends the remaining time before any combination is tried."""
        turns.append(run)
        run.clock.cancel()
        begin(self, run, *rest)

    monkeypatch.setattr(PathRecombination, "__init__", late)
    monkeypatch.setattr(Run, "early_clock", lambda run: contextlib.nullcontext(run.clock))
    result = mmp_planners.make("auto", shorten=20, rounds=10**6).plan(crowded(), seed=0)
    assert len(turns) == 1
    assert result.status is Status.SOLVED
    assert (result.stats["deadline_hit"], result.stats["recombined"]) == (True, 0)
    assert check_plan(result.plan).valid


def of_two_kinds():
    """Returns a run without a plan, the straight plan, and a longer plan."""
    problem = two_arms.one_moves()
    start, goal, away = problem.start["left"], problem.goal["left"], np.array([0.2, 0.0, 0.1, 0.0, 0.0, 0.0])
    right = problem.start["right"]
    plans = [
        retime_to_velocity_limits(problem, [np.vstack(left), np.vstack([right] * len(left))])
        for left in ([start, goal], [start, start + away, goal])
    ]
    return Run.begin("auto", None, problem, 0, math.inf), *plans


def test_a_start_that_becomes_no_shorter_than_the_best_plan_is_not_taken():
    run, short, long = of_two_kinds()
    assert run.offer(short)
    best = run.best
    for attempts in (0, 200):
        assert improve(run, Step(part=Shortcutting(attempts=attempts), seed=0), start=long) == [0]
        assert improve(run, Step(part=LargeNeighbourhoodSearch(attempts=attempts), seed=0), start=short) == [0]
    assert run.best is best
    assert run.counts.shortcuts == 0


def test_a_start_that_is_shorter_is_taken_though_no_part_improves_it():
    run, short, long = of_two_kinds()
    assert run.offer(long)
    assert improve(
        run, Step(part=Shortcutting(attempts=0), seed=0), Step(part=LargeNeighbourhoodSearch(attempts=0), seed=1)
    ) == [0, 0]
    assert run.best.plan is long
    assert improve(
        run,
        Step(part=Shortcutting(attempts=0), seed=0),
        Step(part=LargeNeighbourhoodSearch(attempts=0), seed=1),
        start=short,
    ) == [0, 0]
    assert run.best.plan is short


def test_the_parts_go_on_from_the_start_and_shortcuts_are_counted():
    run, short, long = of_two_kinds()
    first, second = improve(
        run, Step(part=Shortcutting(attempts=200), seed=0), Step(part=Shortcutting(attempts=200), seed=1), start=long
    )
    assert first > 0
    assert run.best.cost == pytest.approx(short.cost_rad, abs=2e-3)
    assert run.counts.shortcuts == first + second


def test_a_start_that_is_not_safe_is_not_taken():
    problem = two_arms.passing()
    run = Run.begin("auto", None, problem, 0, math.inf)
    assert run.offer(mmp_planners.make("rrt-connect", shorten=0).plan(problem, seed=0).plan)
    best = run.best
    interval = retime_to_velocity_limits(
        problem, [np.vstack([problem.start[n], problem.goal[n]]) for n in problem.cell.arm_names]
    )
    assert interval.cost_rad < best.cost
    assert improve(run, Step(part=Shortcutting(attempts=0), seed=0), start=interval) == [0]
    assert run.best is best
