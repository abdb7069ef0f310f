"""Execution of schedules in MuJoCo, on time and with random delays."""

from __future__ import annotations

import pytest

from mmp_env import MmpError, execute_schedule
from tests.support.small_jobs import planned_schedule


@pytest.mark.parametrize(("delays", "seed"), [(0.0, 0), (1.0, 0), (1.0, 1), (5.0, 2)])
def test_schedules_run_without_contact_however_motions_are_delayed(delays, seed):
    report = execute_schedule(planned_schedule(lines=True), delays=delays, seed=seed)
    assert report.reached
    assert not report.contacts
    assert report.nearness.closer_m == 0.0
    assert max(load.share for load in report.loads.values()) < 1.0


def test_delays_make_the_execution_longer():
    on_time, late = (execute_schedule(planned_schedule(), delays=delays) for delays in (0.0, 4.0))
    assert late.duration_s > on_time.duration_s + 1.0


def test_a_schedule_that_takes_too_long_with_its_delays_is_refused():
    with pytest.raises(MmpError, match="it is executed for 1200 s at most"):
        execute_schedule(planned_schedule(), delays=3600.0)
