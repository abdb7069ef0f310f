"""Straight lines in jobs: a move ends where the lines after it are possible, or one sentence says why not."""

from __future__ import annotations

import pytest

from mmp_env import InvalidInstanceError, MmpError, check_schedule
from mmp_env.work.jobs import Line
from mmp_planners import schedule
from tests.support.small_jobs import above, jobs, planned_schedule


def _job(*steps, cell="ring-2", **more):
    return jobs(
        {"schema": "mmp-jobs/1", "name": "one", "cell": cell, "jobs": [{"name": "a", "steps": list(steps)}]} | more
    )


def test_lines_begin_and_end_at_rest_between_other_steps():
    kinds = [event.kind for event in planned_schedule(lines=True).events if event.job == "a"]
    assert kinds == ["move", "line", "wait", "line"]


def test_a_line_may_be_the_first_step_of_a_job():
    result = schedule(_job({"line": [0.0, 0.0, 0.05]}))
    assert result.schedule is not None
    assert check_schedule(result.schedule).valid


def test_the_end_of_a_move_permits_the_lines_after_it():
    # From most of the configurations of this pose the arm cannot follow so long a line.
    result = schedule(_job({"move": above(0.3, 0.1, 0.65)}, {"line": [0.0, 0.0, -0.4]}, {"line": [0.0, 0.0, 0.4]}))
    assert result.schedule is not None
    assert check_schedule(result.schedule).valid


@pytest.mark.parametrize("arm", [{}, {"arm": "arm0"}])
def test_a_line_out_of_reach_is_refused_before_planning(arm):
    steps = [{"move": above(0.3, 0.1, 0.5)}, {"line": [0.0, 0.0, 2.0]}]
    data = {"schema": "mmp-jobs/1", "name": "one", "cell": "ring-2", "jobs": [{"name": "a", "steps": steps, **arm}]}
    with pytest.raises(InvalidInstanceError, match=r"can follow \d+% of its line .*no other end of the move"):
        schedule(jobs(data))


def test_a_line_through_the_table_is_refused():
    with pytest.raises(InvalidInstanceError, match=r"line of arm '\w+' is not free: after \d+% of it"):
        schedule(_job({"move": above(0.3, 0.1, 0.3)}, {"line": [0.0, 0.0, -0.5]}))


@pytest.mark.parametrize("by", [[0, 0], [0, 0, 0], [0, 0, float("inf")], "up", [0, 0, 1e3]])
def test_a_wrong_line_is_refused(by):
    with pytest.raises(MmpError, match=r"line"):
        Line(by)
