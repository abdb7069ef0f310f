"""Execution of a plan in a new simulation."""

from __future__ import annotations

from mmp_env.model.plan import Plan
from mmp_env.sim.execution import ExecutionReport


def execute(plan: Plan) -> ExecutionReport:
    """Executes the plan with the actuators in MuJoCo. Raises `MmpError` if the plan does not fit its cell."""
    from mmp_env.sim.execution import execute_plan
    from mmp_env.sim.simulation import Simulation

    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)
