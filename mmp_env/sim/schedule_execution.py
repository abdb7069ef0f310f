"""Execution of a schedule in a new simulation."""

from __future__ import annotations

from mmp_env.argument_checks import given
from mmp_env.sim.execution import ExecutionReport, execute_plan
from mmp_env.sim.simulation import Simulation
from mmp_env.work.schedule import Schedule


def execute_schedule(schedule: Schedule) -> ExecutionReport:
    """Plays the motions of all arms through the actuators in MuJoCo, on their common clock.

    Args:
        schedule: the schedule.

    Raises:
        MmpError: for another object, or a schedule longer than `LONGEST_EXECUTION_S`.
    """
    plan = given("schedule", schedule, Schedule, "a Schedule, such as load_schedule gives").plan
    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)
