"""Execution of a plan in a new simulation."""

from __future__ import annotations

from mmp_env.model.plan import Plan
from mmp_env.sim.execution import ExecutionReport


def execute(plan: Plan, source: str = "") -> ExecutionReport:
    """Executes the plan with the actuators in MuJoCo, in the model of the file `source` if the plan's cell is from one.

    Raises:
        MmpError: if the plan does not fit its cell or model.
    """
    if plan.problem.cell.joints is not None and source:
        return _play(plan, source)
    from mmp_env.sim.execution import execute_plan
    from mmp_env.sim.simulation import Simulation

    simulation = Simulation(plan.problem.cell)
    simulation.place(simulation.joined(plan.problem.start))
    return execute_plan(simulation, plan)


def _play(plan: Plan, source: str) -> ExecutionReport:
    """Plays a plan in the model of a file, from the configuration that its cell was made in."""
    import mujoco

    from mmp_env.importing.scene.model_file import load_model
    from mmp_env.sim.play import play

    model = load_model(source)
    data = mujoco.MjData(model)
    assert plan.problem.cell.joints is not None
    data.qpos[:] = plan.problem.cell.joints.with_arms(plan.problem.start)
    return play(plan, model, data)
