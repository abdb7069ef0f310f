"""Local repair: blocked arms, arms that are planned again, coupled arms, and cells of many arms."""

import itertools
import math

import numpy as np
import pytest
from support import two_arms

from mmp_env import check_plan, core, draw_problem, find_cell, ring_cell
from mmp_env.events import Replanned, SearchStarted, ignore
from mmp_env.model.certificate import certify
from mmp_planners import Status, StopPlanning, make
from mmp_planners.counts import SingleArmCounts
from mmp_planners.local_repair import LocalRepair
from mmp_planners.planning_context import PlanningContext
from mmp_planners.portfolio.run import Run
from mmp_planners.prioritized import Prioritized
from mmp_planners.priority_search import PrioritySearch
from mmp_planners.repair_search import RepairSearch, _at_full_speed


def search_of(problem, **options):
    """Returns a search, and an independent path of each arm."""
    run = Run.begin("local-repair", None, problem, 0, math.inf)
    alone = Prioritized().search(run, SingleArmCounts(), ignore)
    given = {"patience": 1, "most_coupled": 6} | options
    search = RepairSearch(context=alone.context, counts=alone.counts, emitter=alone.emitter, wait=alone.wait, **given)
    return search, alone.plan_independently(0)


def first_attempt(search, own):
    """Returns the plan of the first attempt, or None if it has none."""
    return next(plan for plan in search.plans(0, own) if plan is not None or search.failed_attempts)


@pytest.mark.parametrize("name", ["line-16", "line-24-panda", "ring-8-panda"])
def test_crowded_cells_are_planned(name):
    result = make("local-repair").plan(draw_problem(find_cell(name), seed=1), seed=1, time_limit=120.0)
    assert result.status is Status.SOLVED
    assert check_plan(result.plan).valid


def test_arms_without_conflicts_keep_their_own_paths():
    result = make("local-repair").plan(two_arms.one_moves(), seed=0)
    assert (result.stats["restarts"], result.stats["low_level_calls"]) == (0, 2)
    assert result.stats["cost_ratio"] == pytest.approx(1.0)


def test_the_same_seed_gives_the_same_plan_and_another_seed_another():
    problem = draw_problem(find_cell("line-16"), seed=2)
    first, again, other = (make("local-repair").plan(problem, seed=seed).plan for seed in (3, 3, 4))
    for name in problem.cell.arm_names:
        np.testing.assert_array_equal(first.positions[name], again.positions[name])
    assert first.cost_rad != other.cost_rad


def test_a_blocked_arm_goes_first_and_the_other_one_around(monkeypatch):
    """The first arm that is planned among others finds no path. So it keeps its own, and the other is planned again."""
    search, own = search_of(two_arms.passing(), patience=100)
    low_level, calls = PlanningContext.low_level, []

    def blocked_at_first(context, arm, constraints, seed, budget=1.0, others=(), experience=None):
        calls.append((arm, len(others)))
        if len(calls) == 1:
            return None, 60
        return low_level(context, arm, constraints, seed, budget, others, experience)

    monkeypatch.setattr(PlanningContext, "low_level", blocked_at_first)
    plan = first_attempt(search, own)
    assert certify(plan, core.Clock(math.inf)).valid
    (blocked, among), *rest = calls
    assert among == 1
    assert (1 - blocked, 1) in rest


def test_arms_that_block_each_other_again_are_planned_together(monkeypatch):
    search, own = search_of(two_arms.passing(), patience=0)
    alone, _ = search_of(two_arms.passing(), patience=0, most_coupled=1)
    monkeypatch.setattr(PlanningContext, "low_level", lambda *_, **__: (None, 60))
    plan = first_attempt(search, own)
    assert certify(plan, core.Clock(math.inf)).valid
    assert first_attempt(alone, own) is None


def test_arms_that_are_far_apart_are_never_compared():
    cell = find_cell("line-64")
    search, _ = search_of(draw_problem(cell, seed=0))
    near = search.near
    assert 3 not in near[63]
    assert max(map(len, near)) < 30
    for a, b in itertools.combinations(range(0, 64, 5), 2):
        assert (b in near[a]) == (a in near[b])


def test_an_attempt_ends_after_too_many_repairs(monkeypatch):
    search, own = search_of(draw_problem(ring_cell(4), seed=2), most_coupled=1)
    monkeypatch.setattr(
        RepairSearch, "near", property(lambda self: [[b for b in range(4) if b != a] for a in range(4)])
    )
    monkeypatch.setattr(PlanningContext, "low_level", lambda *_, **__: (None, 60))
    monkeypatch.setattr(PlanningContext, "conflicts", lambda *_: {(0, 1): np.array([0.0])})
    assert first_attempt(search, own) is None
    assert search.failed_attempts == search.counts.restarts == 1


def test_a_path_at_full_speed_passes_its_corners():
    corners = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.1], [0.5, 0.3, 0.1]])
    first, second = _at_full_speed(corners, [np.array([0.1, 0.1]), np.array([0.2])])
    rows = np.column_stack([first, second])
    assert len(rows) == 1 + 5 + 3
    for corner in corners:
        assert np.abs(rows - corner).max(axis=1).min() < 1e-12
    assert (np.abs(np.diff(rows, axis=0)) <= [0.1 + 1e-9, 0.1 + 1e-9, 0.2 + 1e-9]).all()


@pytest.mark.parametrize("kind", [SearchStarted, Replanned])
def test_a_watcher_ends_the_run_before_there_is_a_plan(kind):
    def stop(event):
        if isinstance(event, kind):
            raise StopPlanning

    result = make("local-repair").plan(two_arms.passing(), watch=stop)
    assert (result.status, result.plan) == (Status.TIMEOUT, None)


def test_no_time_is_no_plan():
    result = make("local-repair").plan(two_arms.passing(), time_limit=0.0)
    assert (result.status, result.stats["deadline_hit"]) == (Status.TIMEOUT, True)


def test_an_arm_that_finds_no_path_even_alone_ends_the_run(monkeypatch):
    monkeypatch.setattr(PrioritySearch, "plan_independently", lambda *_: None)
    assert LocalRepair().plan(two_arms.passing()).status is Status.EXHAUSTED
