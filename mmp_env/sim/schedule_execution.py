"""Execution of a schedule in a new simulation, also with random delays."""

from __future__ import annotations

import numpy as np

from mmp_env.argument_checks import given, known_keywords
from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import LONGEST_EXECUTION_S
from mmp_env.sim.execution import ExecutionReport, execute_plan
from mmp_env.sim.object_simulation import ObjectSimulation
from mmp_env.sim.simulation import Simulation
from mmp_env.work.delays import ActualTimes, actual_times, random_delays
from mmp_env.work.replay import replay
from mmp_env.work.schedule import Schedule


@known_keywords
def execute_schedule(schedule: Schedule, *, delays: float = 0.0, seed: int = 0) -> ExecutionReport:
    """Plays the motions of all arms through the actuators in MuJoCo.

    With delays each motion begins at random up to that much later than it could. An arm that waits for a late one is
    held at the begin of its motion, as the order of the schedule says.

    Args:
        schedule: the schedule.
        delays: longest delay of a motion [s].
        seed: seed of the delays.

    Returns:
        The report. Contacts of objects are among its contacts, but for those that a grasp or a release allows. Its
        clearances of arms are compared with what is proved of the motion that is executed.

    Raises:
        MmpError: for another object, a wrong number, or an execution longer than `LONGEST_EXECUTION_S`.
    """
    given("schedule", schedule, Schedule, "a Schedule, such as load_schedule gives")
    times = actual_times(schedule, random_delays(schedule, delays, seed))
    simulation = simulation_of(schedule, times)
    plan = delayed_plan(schedule, times, simulation.timestep_s)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)


def simulation_of(schedule: Schedule, times: ActualTimes) -> Simulation:
    """Returns a new simulation of the cell of a schedule, with its objects where they are at actual times."""
    cell, jobs = schedule.problem.cell, schedule.jobs
    if not jobs.objects:
        return Simulation(cell)
    found = replay(cell, jobs, schedule.trajectories, schedule.events, times.begins)
    return ObjectSimulation(cell, found.windows)


def delayed_plan(schedule: Schedule, times: ActualTimes, step_s: float) -> Plan:
    """Returns the motion of all arms at actual times, one sample per step [s], with velocities.

    Raises:
        MmpError: if it is longer than `LONGEST_EXECUTION_S`.
    """
    if not times.end_s <= LONGEST_EXECUTION_S:
        raise MmpError(f"the schedule takes {times.end_s:.6g} s; it is executed for {LONGEST_EXECUTION_S:g} s at most")
    clock = step_s * np.arange(int(np.ceil(times.end_s / step_s)) + 1)
    positions, velocities = {}, {}
    for name, trajectory in schedule.trajectories.items():
        phase = times.phase(name, clock)
        positions[name] = trajectory.at(phase)
        velocities[name] = trajectory.velocity(phase)
    return Plan(problem=schedule.problem, times=clock, positions=positions, velocities=velocities)
