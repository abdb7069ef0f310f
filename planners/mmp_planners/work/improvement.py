"""Large neighbourhood search over schedules: a few jobs are given to other arms, or are done earlier or later."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mmp_env import core
from mmp_env.work.jobs import Jobs
from mmp_env.work.schedule import Schedule

MOST_DRAWN = 3
"""Largest number of jobs that a neighbour draws."""


def improved(
    jobs: Jobs,
    schedule: Schedule,
    attempt: Callable[[Jobs], Schedule | None],
    seed: int,
    clock: core.Clock,
    watch: Callable[[Schedule], None],
) -> tuple[Schedule, int]:
    """Returns the schedule with the shortest makespan that was found in time, and the number of attempts.

    Args:
        jobs: the work.
        schedule: a schedule of it.
        attempt: plans jobs in another order and with other arms; None if it fails.
        seed: seed of the draws.
        clock: deadline.
        watch: called with each schedule that is shorter than those before.
    """
    rng, attempts = np.random.default_rng(seed), 0
    while not clock.expired:
        found = attempt(neighbour(jobs, schedule, rng))
        if found is not None and found.makespan_s < schedule.makespan_s:
            schedule = found
            watch(schedule)
        attempts += 1
    return schedule, attempts


def neighbour(jobs: Jobs, schedule: Schedule, rng: np.random.Generator) -> Jobs:
    """Returns the jobs in the order of a schedule and with its arms, but for a few drawn ones.

    One of the drawn jobs is of the arm that ends last. They get random places in the order, and no arm unless `jobs`
    gives them one.
    """
    given = {job.name: job for job in jobs.jobs}
    order = list(schedule.assigned.jobs)
    last = max(schedule.trajectories, key=lambda name: float(schedule.trajectories[name].times[-1]))
    of_last = [job for job in order if job.arm == last] or order
    first = of_last[int(rng.integers(len(of_last)))]
    count = int(rng.integers(MOST_DRAWN))
    others = [order[k] for k in rng.permutation(len(order))[:count]]
    for name in dict.fromkeys(job.name for job in (first, *others)):
        order = [job for job in order if job.name != name]
        order.insert(int(rng.integers(len(order) + 1)), given[name])
    return replace(jobs, jobs=tuple(order))
