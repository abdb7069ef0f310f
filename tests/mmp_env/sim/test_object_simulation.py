"""Execution of schedules with objects in MuJoCo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mmp_env import execute_schedule
from mmp_env.files.reading import Location
from mmp_env.model.held import HELD
from mmp_env.sim.contacts import PHASE
from mmp_env.sim.object_simulation import ObjectSimulation
from mmp_env.work.objects_file import objects_from_data
from mmp_env.work.replay import replay
from tests.support.object_jobs import box, planned_schedule


def simulation(schedule):
    windows = replay(schedule.problem.cell, schedule.jobs, schedule.trajectories, schedule.events).windows
    return ObjectSimulation(schedule.problem.cell, windows)


def there(simulated):
    """Returns the names of the bodies of objects that are there, without their numbers."""
    model = simulated.model
    names = [model.body(int(body)).name for body in model.geom_bodyid]
    shown = [name for k, name in enumerate(names) if PHASE in name and model.geom_contype[k]]
    return sorted(name.partition(PHASE)[0] for name in shown)


def test_a_schedule_is_executed_without_contact():
    report = execute_schedule(planned_schedule())
    assert report.reached
    assert not report.contacts


def test_delays_cause_no_contact():
    for seed in range(3):
        report = execute_schedule(planned_schedule(), delays=2.0, seed=seed)
        assert report.reached
        assert not report.contacts


def test_each_object_is_in_one_place_at_a_time():
    schedule = planned_schedule()
    simulated = simulation(schedule)
    simulated.place(simulated.joined(schedule.problem.start))
    assert there(simulated) == ["obstacle/blue", "obstacle/green", "obstacle/red"]
    grasp = next(event for event in schedule.events if event.kind == "grasp")
    steps = round((grasp.begin_s + 0.1) / simulated.timestep_s)
    rows = np.tile(simulated.positions, (steps, 1))
    simulated.follow(rows, np.zeros_like(rows))
    assert there(simulated) == [f"arm0/{HELD}", "obstacle/blue", "obstacle/green"]


def test_a_contact_with_an_object_is_reported():
    schedule = planned_schedule()
    pose = next(event for event in schedule.events if event.kind == "release").solid.position.tolist()
    grey = objects_from_data([box("grey", pose[0] + 0.03, pose[1])], Location("test"))
    jobs = replace(schedule.jobs, objects=(*schedule.jobs.objects, *grey))
    report = execute_schedule(replace(schedule, jobs=jobs))
    assert any({contact.body_a, contact.body_b} == {f"arm0/{HELD}", "obstacle/grey"} for contact in report.contacts)
