"""Execution of a plan for the command line: in a simulated cell of its own."""

from __future__ import annotations

from mmp_env.model.plan import Plan
from mmp_env.sim.execution import ExecutionReport


def execute(plan: Plan) -> ExecutionReport:
    """Plays the plan through the actuators in MuJoCo. Raises `MmpError` for one that does not fit its cell."""
    from mmp_env.sim.execution import execute_plan
    from mmp_env.sim.simulation import Simulation

    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)
