"""A policy that follows a plan in a dm_control environment."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.dm.task import CellTask
from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_fit
from mmp_env.sim.execution import REACHED_RAD


class Follower:
    """A policy, time step -> action. Each action leads to the configuration of the plan at the end of the action.

    The reference between two actions is straight, so it cuts corners of the plan; a higher control rate cuts less.
    """

    def __init__(self, environment: Any, plan: Plan) -> None:
        self._physics, task = environment.physics, environment.task
        self._task: Any = task
        if not isinstance(task, CellTask):
            raise MmpError(
                f"a plan cannot be followed in {type(environment).__name__}; load the environment with mmp_env.dm.load"
            )
        if task.mode.name != "position":
            raise MmpError("a plan can be followed with control_mode='position' alone; load the environment with it")
        check_fit(plan, _with_objects_of(plan, task.cell))
        missing = [name for name in task.cell.arm_names if name not in plan.positions]
        if missing:
            raise MmpError(f"the plan does not say where arm '{missing[0]}' goes")
        self._plan, self._mode, self._names = plan, task.mode, task.cell.arm_names
        self._period_s = float(environment.control_timestep())

    def __call__(self, time_step: Any) -> Float[np.ndarray, "n"]:
        """Returns the action [n]. Raises `MmpError` if the episode has another start or other objects than the plan."""
        if time_step.first():
            check_fit(self._plan, self._task.cell)
            begin = self._at(0.0)
            if np.abs(begin - time_step.observation["joint_positions"]).max() > REACHED_RAD:
                raise MmpError(
                    "the episode begins elsewhere than the plan; load the environment with random=<its seed>"
                )
        wanted = self._at(float(self._physics.time()) + self._period_s)
        span = self._mode.upper - self._mode.lower
        return 2 * (wanted - self._mode.lower) / span - 1

    def _at(self, t: float) -> Float[np.ndarray, "n"]:
        here = self._plan.at(t)
        return np.concatenate([here[name] for name in self._names])


def _with_objects_of(plan: Plan, cell: Cell) -> Cell:
    """Returns the cell with the obstacles and held objects of the plan. Those of an episode are known at its begin."""
    held = {arm.name: arm.held for arm in plan.problem.cell.arms}
    arms = tuple(dataclasses.replace(arm, held=held.get(arm.name)) for arm in cell.arms)
    return dataclasses.replace(cell, arms=arms, obstacles=plan.problem.cell.obstacles)
