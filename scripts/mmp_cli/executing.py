"""Execution of a plan for the command line: in a simulated cell of its own."""

from __future__ import annotations

from mmp_env.execution import ExecutionReport
from mmp_env.plan import Plan


def execute(plan: Plan) -> ExecutionReport:
    """Plays the plan through the actuators in MuJoCo. Raises `MmpError` for one that does not fit its cell."""
    from mmp_env.execution import execute_plan
    from mmp_env.simulation import Simulation

    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)
