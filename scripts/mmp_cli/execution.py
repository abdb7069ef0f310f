"""Execution of a plan in a new simulation."""

from __future__ import annotations

from pathlib import Path

from mmp_env.errors import MmpError
from mmp_env.importing.scene.model_file import is_model_file, load_model
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.sim.driven import Driven
from mmp_env.sim.execution import ExecutionReport


def execute(plan: Plan, source: str = "") -> ExecutionReport:
    """Executes the plan with the actuators in MuJoCo, in the model of the file `source` if that is one.

    Raises:
        MmpError: if the plan does not fit its cell or model, or the physics of the model diverges.
    """
    from mmp_env.sim.execution import execute_plan

    return execute_plan(_simulation(plan.problem, source), plan)


def check_executable(problem: Problem, source: str) -> None:
    """Raises `MmpError` if `source` is a model in which the arms cannot be driven."""
    if is_model_file(Path(source)):
        try:
            _simulation(problem, source)
        except MmpError as error:
            raise MmpError(f"--execute: {error}") from error


def _simulation(problem: Problem, source: str) -> Driven:
    """Returns a simulation with the arms at their start, and all else as it was when the cell was made."""
    if problem.cell.joints is None or not is_model_file(Path(source)):
        from mmp_env.sim.simulation import Simulation

        simulation = Simulation(problem.cell)
        simulation.place(simulation.joined(problem.start))
        return simulation
    import mujoco

    from mmp_env.sim.play import ModelSimulation

    model = load_model(source)
    data = mujoco.MjData(model)
    data.qpos[:] = problem.cell.joints.with_arms(problem.start)
    return ModelSimulation(problem.cell, model, data)
