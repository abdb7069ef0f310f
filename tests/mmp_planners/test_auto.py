"""The portfolio: the first plan of any member, its improvement, and turns by counts instead of times."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support import two_arms

import mmp_planners
from mmp_env import check_plan, core
from mmp_env.events import NodeCreated, SolutionFound, ignore
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.gym.instances import draw_instance
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners import Status, StopPlanning, auto
from mmp_planners.group_rrt import GroupRrt
from mmp_planners.portfolio import improve
from mmp_planners.portfolio.lns import LargeNeighbourhoodSearch
from mmp_planners.portfolio.shortcutting import Shortcutting, retime_to_velocity_limits
from mmp_planners.portfolio.turns import Turn


def ring(arms=4, seed=2, robot="ur5e"):
    cell = ring_cell(arms, robot)
    return make_problem(cell, *draw_instance(cell, seed=seed))


def test_the_plan_is_much_shorter_than_the_first_plan():
    problem = ring(6, 1)
    first = mmp_planners.make("auto", shorten=0, rounds=0).plan(problem, seed=0)
    best = mmp_planners.make("auto").plan(problem, seed=0)
    assert best.stats["found_by"] == first.stats["found_by"] == "group-rrt"
    assert best.stats["cost_ratio"] < 1.06 < first.stats["cost_ratio"]
    assert check_plan(best.plan).valid


def test_a_plan_that_is_good_enough_is_not_improved_any_more():
    problem = ring(6, 1)
    first = mmp_planners.make("auto", until=10.0).plan(problem, seed=0).stats
    assert (first["shortcuts"], first["deadline_hit"]) == (0, False)
    better = mmp_planners.make("auto", until=0.5 * (1.0 + first["cost_ratio"])).plan(problem, seed=0).stats
    assert better["shortcuts"] > 0
    assert better["cost_ratio"] < 0.5 * (1.0 + first["cost_ratio"])


def test_a_watcher_gets_each_better_plan():
    emitted = []
    result = mmp_planners.make("auto", until=1.0).plan(ring(6, 1, "panda"), seed=0, watch=emitted.append)
    costs = [event.cost_rad for event in emitted if isinstance(event, SolutionFound)]
    assert len(costs) > 2
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == result.stats["cost_rad"]
    nodes = {event.node: event for event in emitted if isinstance(event, NodeCreated)}
    last = max(nodes)
    assert nodes[last].parent == last - 1


def leave_out_groups(monkeypatch):
    """Replaces the search for groups by one that never finds a plan."""

    def never(self, run, watch=ignore):
        while not run.clock.expired:
            yield Turn(100)

    monkeypatch.setattr(GroupRrt, "turns", never)


def test_the_tree_finds_a_plan_where_the_search_for_groups_finds_none(monkeypatch):
    leave_out_groups(monkeypatch)
    result = mmp_planners.make("auto").plan(ring(4, 5), seed=0)
    assert result.status is Status.SOLVED
    assert result.stats["found_by"] == "apf-ecbs"
    assert result.stats["bound_met"] is None
    assert 0 < result.stats["first_plan_s"] <= result.stats["planning_time_s"]
    assert check_plan(result.plan).valid


def test_a_watcher_that_stops_on_the_plan_of_the_tree_gets_that_plan(monkeypatch):
    leave_out_groups(monkeypatch)
    emitted = []

    def watch(event):
        emitted.append(event)
        if isinstance(event, SolutionFound):
            raise StopPlanning

    result = mmp_planners.make("auto").plan(ring(4, 5), seed=0, watch=watch)
    assert result.status is Status.SOLVED
    assert result.plan.cost_rad == pytest.approx(emitted[-1].cost_rad)
    assert (result.stats["shortcuts"], result.stats["bound_met"]) == (0, None)
    assert result.stats["found_by"] == "apf-ecbs"
    assert 0 < result.stats["first_plan_s"] <= result.stats["planning_time_s"]
    assert result.stats["min_clearance_m"] >= result.plan.problem.margin
    assert check_plan(result.plan).valid


def test_there_are_no_counts_of_a_tree_where_no_tree_was_grown():
    stats = mmp_planners.make("auto").plan(ring(6, 1), seed=0, watch=[].append).stats
    assert stats["found_by"] == "group-rrt"
    assert (stats["expanded_nodes"], stats["generated_nodes"], stats["fast_track_tries"]) == (None, None, None)


def test_the_numbers_of_the_plans_come_after_those_of_the_nodes_of_the_tree(monkeypatch):
    leave_out_groups(monkeypatch)
    emitted = []
    result = mmp_planners.make("auto").plan(ring(4, 5), seed=0, watch=emitted.append)
    nodes = [event.node for event in emitted if isinstance(event, NodeCreated)]
    assert len(nodes) == len(set(nodes))
    assert result.stats["generated_nodes"] in nodes
    assert nodes[-1] > result.stats["generated_nodes"] or result.stats["shortcuts"] == 0


def test_turns_and_not_times_decide(monkeypatch):
    problem = ring(6, 3, "panda")
    plans = []
    for tick in (0.0, 10.0):  # a machine on which every call takes ten seconds longer
        clock = core.Clock(math.inf)
        monkeypatch.setattr(auto.Run, "elapsed_s", property(lambda run, tick=tick: tick))
        plans.append(plan_to_dict(mmp_planners.make("auto").plan(problem, seed=4).plan))
        assert not clock.expired
    assert plans[0] == plans[1]


def test_a_shortest_plan_is_not_changed():
    result = mmp_planners.make("auto").plan(two_arms.one_moves(), seed=0)
    assert result.stats["cost_ratio"] == pytest.approx(1.0, abs=1e-3)
    assert result.stats["low_level_calls"] == 0


def test_watchers_see_the_first_plan_and_the_best_one():
    seen = []
    result = mmp_planners.make("auto").plan(ring(6, 1), seed=0, watch=seen.append)
    nodes = [event for event in seen if isinstance(event, NodeCreated)]
    solutions = [event for event in seen if isinstance(event, SolutionFound)]
    assert [n.node for n in nodes] == [s.node for s in solutions] == list(range(len(nodes)))
    assert [n.parent for n in nodes] == [None, *range(len(nodes) - 1)]
    *costs, last = [n.cost_rad for n in nodes]
    assert len(costs) > 1
    assert all(later < earlier for earlier, later in pairwise(costs))
    assert last == result.plan.cost_rad == pytest.approx(costs[-1], abs=1e-4)


@pytest.mark.parametrize("rounds", [0, 40])
def test_waits_are_removed_unless_they_are_kept(rounds):
    # With fewer rounds of shortcuts the plans differ in their waits and in little else.
    planners = (mmp_planners.make("auto", until=1.01, rounds=rounds, waits=waits) for waits in ("kept", "removed"))
    kept, removed = (planner.plan(ring(6, 1), seed=0) for planner in planners)
    if rounds == 0:  # shortcuts of a plan without waits differ
        assert removed.stats["cost_rad"] == pytest.approx(kept.stats["cost_rad"], abs=1e-4)
    assert removed.stats["makespan_s"] < 0.9 * kept.stats["makespan_s"]


@pytest.mark.parametrize(("waits", "before"), [("removed", 1), ("kept", 0)])
def test_waits_are_removed_once_before_the_first_round(waits, before, monkeypatch):
    calls = []
    monkeypatch.setattr(improve, "without_waits", lambda plan, clock: calls.append(plan))
    assert mmp_planners.make("auto", rounds=3, waits=waits).plan(ring(6, 1), seed=0).plan is not None
    assert len(calls) == before


@pytest.mark.parametrize(
    ("long_plan", "expected"),
    [
        (1.0, [(LargeNeighbourhoodSearch, 4, 0.3), (Shortcutting, 300, 0.3)]),
        (math.inf, [(Shortcutting, 300, 0.2), (LargeNeighbourhoodSearch, 7, 0.2)]),
    ],
)
def test_a_long_first_plan_is_replanned_less_and_before_it_is_shortened(long_plan, expected, monkeypatch):
    rounds = []

    def spy(run, *steps, start=None):
        rounds.append([(type(step.part), step.part.attempts, pytest.approx(step.part.dt)) for step in steps])
        return improve_plan(run, *steps, start=start)

    improve_plan = improve.improve
    monkeypatch.setattr(improve, "improve", spy)
    monkeypatch.setattr(auto, "SETTINGS", replace(auto.SETTINGS, long_plan=long_plan))
    mmp_planners.make("auto", rounds=2, replan=7).plan(ring(6, 1), seed=0)
    assert rounds == [expected, [(Shortcutting, 300, 0.2), (LargeNeighbourhoodSearch, 7, 0.2)]]


def test_no_time_finds_nothing():
    result = mmp_planners.make("auto").plan(ring(), time_limit=0.0)
    assert result.status is Status.TIMEOUT
    assert result.plan is None


def test_replanning_removes_a_detour_that_no_shortcut_can():
    problem = two_arms.one_moves()
    start, goal = problem.start["left"], problem.goal["left"]
    via = start + np.array([0.0, -0.5, 0.4, 0.0, 0.0, 0.0])
    there = np.vstack([start + f * (via - start) for f in np.linspace(0, 1, 9)])
    back = np.vstack([via + f * (goal - via) for f in np.linspace(0, 1, 9)[1:]])
    plan = retime_to_velocity_limits(
        problem, [np.vstack([there, back]), problem.start["right"][None].repeat(17, axis=0)]
    )
    better, kept = LargeNeighbourhoodSearch(attempts=1)(plan, 0, core.Clock(math.inf))
    assert kept == 1
    assert better.cost_rad == pytest.approx(problem.cost_lower_bound_rad, abs=1e-4)
    assert check_plan(better).valid


def test_a_plan_with_detours_is_replanned_and_the_attempts_that_helped_are_counted():
    ratios, replanned = {True: 0.0, False: 0.0}, 0
    for seed in range(6):
        problem = ring(6, seed, "panda")
        stats = mmp_planners.make("auto", shorten=1, rounds=1).plan(problem, seed=0).stats
        without = mmp_planners.make("auto", shorten=1, rounds=1, replan=0).plan(problem, seed=0).stats
        assert without["replanned"] == 0
        replanned += stats["replanned"]
        ratios[True] += stats["cost_ratio"]
        ratios[False] += without["cost_ratio"]
    assert replanned > 0
    assert ratios[True] < ratios[False]
