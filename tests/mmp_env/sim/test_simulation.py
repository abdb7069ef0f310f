"""The simulated cell: both methods of stepping agree, contacts are timed and counted, faults are named."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from mmp_env.errors import MmpError
from mmp_env.model.rings import ring_cell
from mmp_env.model.robot_reading import load_robot
from mmp_env.sim.simulation import Simulation

STEEP, LEVEL = (np.tile([np.pi, lift, 0.0, 0.0, 0.0, 0.0], 2) for lift in (-1.3, -0.3))
"""Configuration of two arms of a ring stretched out towards its centre."""
STEPS = 50


def driven(one_by_one):
    """Drives two arms into each other and apart again in ten ramps, each in one call or step `one_by_one`."""
    simulation = Simulation(ring_cell(2))
    simulation.place(STEEP)
    marks = STEEP + np.concatenate([np.linspace(0, 1, 8), [0.6, 0.2, 0.0]])[:, None] * (LEVEL - STEEP)
    path = []
    for begin, end in pairwise(marks):
        if one_by_one:
            simulation.set_reference(begin, end, STEPS)
            for _ in range(STEPS):
                simulation.advance(1)
        else:
            simulation.ramp(begin, end, STEPS)
        path.append(simulation.positions)
    return np.array(path), simulation.log.contacts


def test_steps_left_to_mujoco_and_steps_one_by_one_are_the_same_to_the_last_bit():
    (path, contacts), (single_path, single_contacts) = driven(one_by_one=False), driven(one_by_one=True)
    np.testing.assert_array_equal(path, single_path)
    assert contacts == single_contacts
    assert contacts


def test_the_contacts_do_not_depend_on_where_calls_of_mujoco_end():
    def contacts(ends):
        simulation = Simulation(ring_cell(2))
        simulation.place(STEEP)
        for begin, end in pairwise(STEEP + np.linspace(0, 1, 8)[:, None] * (LEVEL - STEEP)):
            simulation.set_reference(begin, end, STEPS)
            for first, last in pairwise([0, *ends, STEPS]):
                simulation.advance(last - first)
        return simulation.log.contacts

    wanted = contacts(range(1, STEPS))
    assert wanted
    for shift in range(1, 14):
        assert contacts([shift]) == wanted


def test_after_placing_arms_apart_nothing_is_watched_for_contacts(monkeypatch):
    simulation = Simulation(ring_cell(2))
    simulation.place(LEVEL)
    simulation.ramp(LEVEL, LEVEL, STEPS)
    assert simulation.log.contacts
    simulation.place(STEEP)
    monkeypatch.setattr(simulation, "_step_watched", None)
    simulation.ramp(STEEP, STEEP, STEPS)


def test_a_ramp_of_a_single_physics_step_is_one():
    simulation = Simulation(ring_cell(2))
    simulation.place(STEEP)
    simulation.ramp(STEEP, STEEP, 1)
    assert simulation.data.time == simulation.timestep_s


def test_a_ramp_is_followed_without_lag():
    simulation = Simulation(ring_cell(4, "panda"))
    start = simulation.joined({arm.name: arm.robot.tucked for arm in simulation.cell.arms})
    simulation.place(start)
    end = start + 0.8 * 0.3 * np.tile([0.5, -0.2, 0.3, 0.0, 1.0, 0.2, -1.0], 4)
    simulation.ramp(start, end, 150)
    np.testing.assert_allclose(simulation.positions, end, atol=2e-3)
    np.testing.assert_allclose(simulation.velocities, (end - start) / 0.3, atol=5e-3)


def test_bodies_that_touch_from_the_start_are_a_contact_at_time_zero():
    simulation = Simulation(ring_cell(2))
    simulation.place(np.tile([np.pi, -0.1, 0.0, 0.0, 0.0, 0.0], 2))
    assert {contact.time_s for contact in simulation.log.contacts} == {0.0}


def test_a_simulation_that_diverges_says_so(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log into the working directory
    simulation = Simulation(ring_cell(2))
    simulation.place(STEEP)
    simulation.data.qvel[:] = np.nan
    with pytest.raises(MmpError, match="cell 'ring-2' diverged"):
        simulation.ramp(STEEP, STEEP, STEPS)


def test_joints_that_are_not_those_of_the_robot_are_named():
    robot = load_robot("ur5e")
    mjcf = robot.mjcf.replace('"joint3"', '"elbow"')
    cell = ring_cell(2)
    arm = dataclasses.replace(cell.arms[0], robot=dataclasses.replace(robot, mjcf=mjcf))
    with pytest.raises(MmpError, match=r"has joints .*'arm0/elbow'.*expected"):
        Simulation(dataclasses.replace(cell, arms=(arm, cell.arms[1])))


def test_names_of_arms_may_have_braces():
    cell = ring_cell(2)
    arms = [dataclasses.replace(arm, name=name) for arm, name in zip(cell.arms, ("{arm}", "{0}"), strict=True)]
    assert list(Simulation(dataclasses.replace(cell, arms=tuple(arms))).slices) == ["{arm}", "{0}"]
