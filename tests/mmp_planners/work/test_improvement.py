"""Improvement of schedules: never longer, all jobs done, and arms that the jobs name are kept."""

from __future__ import annotations

import numpy as np
import pytest

from mmp_env import core
from mmp_env.check.schedule import check_schedule_document
from mmp_env.errors import MmpError
from mmp_env.work.schedule_file import schedule_to_dict
from mmp_planners import schedule
from mmp_planners.work.improvement import MOST_DRAWN, improved, neighbour
from tests.support.small_jobs import jobs, planned_schedule


def test_a_neighbour_has_the_same_jobs_and_their_given_arms():
    work, found = jobs(), planned_schedule()
    given = {job.name: job for job in work.jobs}
    orders = set()
    for seed in range(50):
        near = neighbour(work, found, np.random.default_rng(seed))
        assert sorted(job.name for job in near.jobs) == sorted(given)
        assert all(given[job.name].arm in (None, job.arm) for job in near.jobs)
        assert sum(job.arm is None for job in near.jobs) <= MOST_DRAWN
        orders.add(tuple(job.name for job in near.jobs))
    assert len(orders) > 5


def test_the_shortest_schedule_is_kept():
    clock = core.Clock(1e9)
    shortest, longest = sorted((planned_schedule(), planned_schedule(lines=True)), key=lambda each: each.makespan_s)
    answers = [None, shortest, longest]

    def attempt(_):
        if len(answers) == 1:
            clock.cancel()
        return answers.pop(0)

    watched = []
    assert improved(longest.jobs, longest, attempt, 0, clock, watched.append) == (shortest, 3)
    assert watched == [shortest]


def test_an_improved_schedule_is_valid_and_not_longer():
    work = jobs()
    result = schedule(work, improve=2.0)
    assert result.schedule is not None
    assert result.schedule.makespan_s <= result.stats["first_makespan_s"]
    assert result.stats["attempts"] > 0
    assert result.schedule.jobs is work
    assert check_schedule_document(schedule_to_dict(result.schedule)).valid


def test_a_negative_time_is_refused():
    with pytest.raises(MmpError, match="improve is -1"):
        schedule(jobs(), improve=-1.0)
    with pytest.raises(MmpError, match=r"improve is 4 s; it must be at most the time limit of 0.5 s"):
        schedule(jobs(), improve=4.0, time_limit=0.5)
