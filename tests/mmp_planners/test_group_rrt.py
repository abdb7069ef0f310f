"""RRT-Connect for groups of arms as a planner: many arms, restarts, candidates, seeds and stops."""

import itertools
import math

import numpy as np
import pytest
from support import two_arms

from mmp_env import check_plan, draw_problem, find_cell
from mmp_env.events import SearchStarted
from mmp_env.model.goals import AnyOf
from mmp_env.problems.making import make_problem
from mmp_planners import Status, StopPlanning, group_rrt, make
from mmp_planners.portfolio.run import Run


@pytest.mark.parametrize("name", ["line-16", "line-24-panda", "ring-8-panda"])
def test_crowded_cells_are_planned(name):
    result = make("group-rrt", shorten=0).plan(draw_problem(find_cell(name), seed=1), seed=1, time_limit=120.0)
    assert result.status is Status.SOLVED
    assert check_plan(result.plan).valid


def test_arms_that_go_straight_to_their_goals_do_that():
    result = make("group-rrt").plan(two_arms.one_moves(), seed=0)
    assert result.stats["cost_ratio"] == pytest.approx(1.0)
    assert result.stats["restarts"] == 0


def test_the_same_seed_gives_the_same_plan_and_another_seed_another():
    problem = draw_problem(find_cell("ring-6"), seed=2)
    first, again, other = (make("group-rrt").plan(problem, seed=seed).plan for seed in (3, 3, 4))
    for name in problem.cell.arm_names:
        np.testing.assert_array_equal(first.positions[name], again.positions[name])
    assert first.cost_rad != other.cost_rad


def test_an_attempt_of_too_few_iterations_begins_again_and_later_ones_are_longer(monkeypatch):
    monkeypatch.setattr(group_rrt, "ITERATIONS_PER_ARM", 1)
    monkeypatch.setattr(group_rrt, "TURN", 1)
    seen = []
    result = make("group-rrt").plan(draw_problem(find_cell("ring-8"), seed=2), seed=0, watch=seen.append)
    restarts = [event.restart for event in seen if isinstance(event, SearchStarted)]
    assert result.status is Status.SOLVED
    assert result.stats["restarts"] == restarts[-1] > 0
    assert restarts == list(range(len(restarts)))


def test_each_attempt_takes_the_next_combination_of_candidates(monkeypatch):
    """The proof of the first plan fails, so there is a second attempt."""
    plain = two_arms.passing()
    goals = [plain.goal["left"], plain.goal["left"] + 0.05]
    problem = make_problem(plain.cell, plain.start, {"left": AnyOf(goals), "right": plain.goal["right"]})
    offered = []
    monkeypatch.setattr(Run, "offer", lambda run, plan: offered.append(plan) or len(offered) == 2)
    make("group-rrt", shorten=0).plan(problem, seed=0)
    ends = {tuple(plan.positions["left"][-1].round(6)) for plan in offered}
    assert ends == {tuple(q.round(6)) for q in goals}


def test_attempts_fail_soon_and_count_their_work_if_more_arms_block_each_other_than_a_group_may_have():
    """The goal of each hand is where the other one starts. So other members of a portfolio get their turn."""
    run = Run.begin("group-rrt", None, two_arms.passing(1.0), 0, math.inf)
    turns = list(itertools.islice(group_rrt.GroupRrt(most=1).turns(run), 12))
    assert run.best is None
    assert sum(turn.failed for turn in turns) >= 6
    assert sum(turn.work for turn in turns) > 6 * group_rrt.TURN


def test_a_watcher_ends_the_run_before_there_is_a_plan():
    def stop(event):
        raise StopPlanning

    result = make("group-rrt").plan(two_arms.passing(), watch=stop)
    assert (result.status, result.plan) == (Status.TIMEOUT, None)


def test_no_time_is_no_plan():
    result = make("group-rrt").plan(two_arms.passing(), time_limit=0.0)
    assert (result.status, result.stats["deadline_hit"]) == (Status.TIMEOUT, True)
