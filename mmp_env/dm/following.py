"""A policy that plays a plan in a dm_control environment."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.dm.task import CellTask
from mmp_env.errors import MmpError
from mmp_env.gym.control import PositionMode
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_fit
from mmp_env.sim.execution import REACHED_RAD


class Follower:
    """Time step -> action: where the plan is at the end of the action; after its last time, its end.

    Between two actions the reference is straight, so a corner of the plan between them is cut; a higher control rate
    cuts less.
    """

    def __init__(self, environment: Any, plan: Plan) -> None:
        self._physics, task = environment.physics, environment.task
        self._task: Any = task
        if not isinstance(task, CellTask):
            raise MmpError(f"a plan cannot be followed in {type(environment).__name__}; mmp_env.dm.load makes what can")
        if not isinstance(task.mode, PositionMode):
            raise MmpError("a plan can be followed with control_mode='position' alone; load the environment with it")
        check_fit(plan, _with_objects_of(plan, task.cell))
        missing = [name for name in task.cell.arm_names if name not in plan.positions]
        if missing:
            raise MmpError(f"the plan does not say where arm '{missing[0]}' goes")
        self._plan, self._mode, self._names = plan, task.mode, task.cell.arm_names
        self._period_s = float(environment.control_timestep())

    def __call__(self, time_step: Any) -> Float[np.ndarray, "n"]:
        """Raises `MmpError` where an episode begins elsewhere than the plan, or has other objects."""
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
    """The cell with the plan's obstacles and held objects: which an episode has is known when it begins."""
    held = {arm.name: arm.held for arm in plan.problem.cell.arms}
    arms = tuple(dataclasses.replace(arm, held=held.get(arm.name)) for arm in cell.arms)
    return dataclasses.replace(cell, arms=arms, obstacles=plan.problem.cell.obstacles)
