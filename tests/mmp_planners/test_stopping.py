"""`StopPlanning` from a signal handler at any line: while a search is set up, and after its end."""

import sys

import pytest
from support import two_arms

from mmp_env import check_plan
from mmp_planners import Status, StopPlanning, make, tree_planner
from mmp_planners.counts import TreeCounts
from mmp_planners.portfolio import run as run_module

PROBLEM = two_arms.one_moves()


def stopped_at_line(number):
    """Stops a run at that line of making the result. Returns the result, and the number of lines executed."""
    seen = 0

    def in_lines(frame, event, argument):
        nonlocal seen
        if event == "line":
            seen += 1
            if seen == number:
                raise StopPlanning
        return in_lines

    def trace(frame, event, argument):
        in_result = frame.f_code.co_name == "_result" and frame.f_code.co_filename == run_module.__file__
        return in_lines if in_result else None

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        return make("ecbs").plan(PROBLEM, seed=0), seen
    finally:
        sys.settrace(before)


def test_a_stop_while_the_result_is_made_loses_nothing():
    whole, lines = stopped_at_line(0)
    assert lines > 10
    for number in range(1, lines + 1):
        result, seen = stopped_at_line(number)
        assert seen == number, "the run was stopped there"
        assert result.status is Status.SOLVED
        assert check_plan(result.plan).valid
        assert result.plan.stats == whole.plan.stats


@pytest.mark.parametrize("name", ["cbs", "gen-ecbs", "apf-ecbs"])
def test_a_stop_before_the_search_begins_is_a_result_without_a_plan(name, monkeypatch):
    class Struck:
        def __init__(self, *arguments):
            raise StopPlanning

    monkeypatch.setattr(tree_planner, "PlanningContext", Struck)
    result = make(name).plan(PROBLEM, seed=0)
    assert (result.status, result.plan) == (Status.TIMEOUT, None)
    assert {key: result.stats[key] for key in vars(TreeCounts())} == vars(TreeCounts())
    assert result.stats["cost_lower_bound_rad"] == PROBLEM.cost_lower_bound_rad
