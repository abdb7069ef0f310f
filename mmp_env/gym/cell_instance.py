"""The instances of an environment: drawn by its task or given, each with the cell that it is for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.brief import brief
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym.instances import draw, find_task
from mmp_env.model.cell import Cell
from mmp_env.model.margins import Margins
from mmp_env.model.problem import Problem, asked_velocity_limits, make_problem
from mmp_env.model.task import State, Task
from mmp_env.wording import counted

_ENDS = ("start", "goal")


@dataclass(frozen=True, kw_only=True, eq=False)
class CellInstance:
    """Where the arms of a cell come from and go to, arm name -> [dof] [rad]; `max_velocity` [rad/s]."""

    cell: Cell
    start: State
    goal: State
    max_velocity: float
    name: str = ""
    margins: Margins | None = None
    """Margins that are kept; None: the default ones."""

    @brief
    def __repr__(self) -> str:
        return f"{self.name}{': ' if self.name else ''}{counted(len(self.cell.arms), 'arm')} in cell {self.cell.name}"

    @cached_property
    def problem(self) -> Problem:
        """The instance as planners take it. Raises `InvalidInstanceError` where a task has drawn a bad one."""
        return make_problem(
            self.cell, self.start, self.goal, max_velocity=self.max_velocity, margin=self.margins, name=self.name
        )


class InstanceSource:
    """What an environment has its instances from: `cell`, which a task may furnish anew for each, and the task.

    Raises `MmpError` for an unknown task, and a `max_velocity` [rad/s] that is not positive, or looks like degrees.
    """

    def __init__(self, cell: Cell, task: str | Task, max_velocity: float) -> None:
        self.cell, self._task, self._max_velocity = cell, find_task(task), max_velocity
        limits = asked_velocity_limits(cell, max_velocity)
        self.fastest: Float[np.ndarray, "n"] = np.concatenate([limits[name] for name in cell.arm_names])
        """Of all joints, arm after arm [rad/s]."""

    def following(self, given: Any, rng: np.random.Generator, name: str = "") -> CellInstance:
        """The next instance: `start` and `goal` (arm name -> [dof] [rad]) as `given`, drawn what is not.

        Where both are given, it is for the cell without objects, and nothing is drawn. Raises `MmpError` for anything
        else than a dict of these, and like `drawn` and `given`.
        """
        if not isinstance(given, Mapping):
            raise MmpError(f"reset options are a {type(given).__name__}; they must be a dict with start, goal or both")
        for key, state in given.items():
            if key not in _ENDS:
                raise UnknownNameError("reset option", key, _ENDS)
            if not isinstance(state, Mapping):
                raise MmpError(f"reset option {key} is {state!r}; it must be arm name -> joints [rad]")
        if len(given) == len(_ENDS):
            return self.given(**given)
        drawn = self.drawn(rng, name)
        if not given:
            return drawn
        return self.given(**{"start": drawn.start, "goal": drawn.goal, **given}, cell=drawn.cell)

    def drawn(self, rng: np.random.Generator, name: str = "") -> CellInstance:
        """The next instance of the task. Raises `MmpError` where it finds none."""
        drawn = draw(self.cell, self._task, rng)
        return self.instance(drawn.cell, drawn.start, drawn.goal, name)

    def given(
        self, start: Mapping[str, ArrayLike], goal: Mapping[str, ArrayLike], cell: Cell | None = None
    ) -> CellInstance:
        """An instance for `cell`, or for the one without the objects of any task.

        Raises `MmpError` for arms that are missing or have other numbers of joints, and `InvalidInstanceError` for
        what is out of limits or in collision.
        """
        problem = make_problem(cell or self.cell, start, goal, max_velocity=self._max_velocity)
        instance = self.instance(problem.cell, problem.start, problem.goal)
        vars(instance)["problem"] = problem  # what is made already need not be made again
        return instance

    def instance(
        self, cell: Cell, start: State, goal: State, name: str = "", margins: Margins | None = None
    ) -> CellInstance:
        """An instance as it stands, at the speed of the environment."""
        speed = self._max_velocity
        return CellInstance(cell=cell, start=start, goal=goal, max_velocity=speed, name=name, margins=margins)
