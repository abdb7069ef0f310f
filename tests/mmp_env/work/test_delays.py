"""Delays: every motion waits for those that it must not overtake, and no delay causes a contact."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mmp_env import MmpError, core
from mmp_env.model.certificate import certify
from mmp_env.sim.schedule_execution import delayed_plan
from mmp_env.work.delays import actual_times, random_delays
from mmp_env.work.schedule import numbered
from tests.support.small_jobs import planned_schedule

PATTERNS = 8


def test_without_delays_everything_happens_when_it_is_due():
    schedule = planned_schedule()
    times = actual_times(schedule, {})
    due = {name: event.begin_s for name, event in numbered(schedule.events).items()}
    assert dict(times.begins) == pytest.approx(due)
    clock = np.linspace(0.0, schedule.makespan_s, 50)
    for arm in schedule.trajectories:
        own = clock[clock <= times.phases[arm][0][-1]]
        assert times.phase(arm, own) == pytest.approx(own)


def test_a_motion_waits_for_those_that_the_order_names():
    schedule = planned_schedule()
    pair = schedule.order[0]
    times = actual_times(schedule, {pair.first: 5.0})
    assert times.begins[pair.second] >= times.begins[pair.first] + pair.past_s
    assert times.begins[pair.second] > numbered(schedule.events)[pair.second].begin_s + 4.0


def test_all_delays_together_bound_the_end():
    schedule = planned_schedule(lines=True)
    for seed in range(PATTERNS):
        delays = random_delays(schedule, 2.0, seed)
        assert actual_times(schedule, delays).end_s <= schedule.makespan_s + sum(delays.values()) + 1e-9


@pytest.mark.parametrize("lines", [False, True])
def test_every_delayed_motion_is_certified(lines):
    schedule = planned_schedule(lines)
    for seed in range(PATTERNS):
        plan = delayed_plan(schedule, actual_times(schedule, random_delays(schedule, 3.0, seed)), 0.02)
        certificate = certify(plan, core.Clock(60.0))
        assert certificate.valid
        assert certificate.proved.arms >= schedule.problem.margins.arms


def test_without_its_order_some_delay_causes_a_contact():
    schedule = dataclasses.replace(planned_schedule(), order=())
    delayed = (
        delayed_plan(schedule, actual_times(schedule, random_delays(schedule, 3.0, seed)), 0.02)
        for seed in range(PATTERNS)
    )
    assert not all(certify(plan, core.Clock(60.0)).valid for plan in delayed)


@pytest.mark.parametrize("longest", [-1.0, float("nan")])
def test_a_wrong_delay_is_refused(longest):
    with pytest.raises(MmpError, match="the longest delay"):
        random_delays(planned_schedule(), longest, 0)
