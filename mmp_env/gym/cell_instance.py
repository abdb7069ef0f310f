"""The instances of an environment, drawn by its task or given, each with its cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias, cast

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.gym.instances import are_configurations, draw, find_task
from mmp_env.model.cell import Cell
from mmp_env.model.goals import STAY, Goal, as_goal
from mmp_env.model.margins import Margins, asked_margins
from mmp_env.model.problem import Problem, asked_velocity_limits
from mmp_env.model.task import Asked, State, Task
from mmp_env.problems.making import make_problem
from mmp_env.wording import counted

Margin: TypeAlias = float | Mapping[str, float] | Margins | None
"""Margin that is asked for [m]: one number, one for each kind, or None for the default."""
_ENDS = ("start", "goal")


@dataclass(frozen=True, kw_only=True, eq=False)
class CellInstance:
    """Start and goal of the arms of a cell, arm name -> [dof] [rad]; `max_velocity` [rad/s].

    `margin` is what plans for the instance must keep, in the forms that `make_problem` takes.
    """

    cell: Cell
    start: State
    goal: State
    max_velocity: float
    name: str = ""
    margin: Margin = None

    @brief
    def __repr__(self) -> str:
        return f"{self.name}{': ' if self.name else ''}{counted(len(self.cell.arms), 'arm')} in cell {self.cell.name}"

    @cached_property
    def problem(self) -> Problem:
        """The instance as a problem for planners.

        Raises:
            InvalidInstanceError: if start or goal is out of limits, in collision, or closer than `margin`.
        """
        return make_problem(
            self.cell, self.start, self.goal, max_velocity=self.max_velocity, margin=self.margin, name=self.name
        )


class InstanceSource:
    """The source of all instances of an environment: its task, or a start and goal that are given.

    Args:
        cell: the cell without the objects of any task.
        task: the task that draws instances, or its name.
        max_velocity: largest velocity of all joints [rad/s].
        margin: margins of all instances, in the forms that `make_problem` takes.

    Raises:
        MmpError: for an unknown task, a bad margin, or a `max_velocity` that is not positive or looks like degrees.
    """

    def __init__(self, cell: Cell, task: str | Task, max_velocity: float, margin: Margin = None) -> None:
        self.cell, self._task, self._max_velocity = cell, find_task(task), max_velocity
        self._margin = asked_margins(margin) or None
        limits = asked_velocity_limits(cell, max_velocity)
        self.fastest: Float[np.ndarray, "n"] = np.concatenate([limits[name] for name in cell.arm_names])
        """Largest velocity of every joint, arm after arm [rad/s]."""

    def asked(self, given: Any) -> dict[str, dict[str, Goal]]:
        """Returns the goals in the options of a reset: `start`, `goal`, both or neither, arm name -> goal.

        An arm that `goal` leaves out stays. Raises `MmpError` for anything but such a dict.
        """
        if not isinstance(given, Mapping):
            raise MmpError(f"reset options are a {type(given).__name__}; they must be a dict with start, goal or both")
        out: dict[str, dict[str, Goal]] = {}
        for key, asked in given.items():
            if key not in _ENDS:
                raise UnknownNameError("reset option", key, _ENDS)
            if not isinstance(asked, Mapping):
                raise MmpError(f"reset option {key} is {asked!r}; it must be arm name -> joints [rad] or another goal")
            everyone = dict.fromkeys(self.cell.arm_names, STAY) if key == "goal" else {}
            out[key] = {arm: as_goal(each, f"{key} of arm '{arm}'") for arm, each in {**everyone, **asked}.items()}
        return out

    def following(self, given: Any, rng: np.random.Generator, name: str = "") -> CellInstance:
        """Returns the next instance.

        Args:
            given: a dict with `start`, `goal`, both or neither, arm name -> a configuration [dof] [rad] or another
                goal. The task draws a missing one. With both, nothing is drawn, and the cell has no objects of the
                task.
            rng: the source of all random numbers.
            name: name of a drawn instance.

        Raises:
            MmpError: for anything but such a dict, or if the task finds no instance.
            InvalidInstanceError: if start or goal is out of reach, out of limits, in collision, or closer than the
                margin.
        """
        asked = self.asked(given)
        if len(asked) == len(_ENDS):
            return self._validated(self.cell, asked["start"], asked["goal"])
        drawn = self.drawn(rng, name)
        if not asked:
            return drawn
        return self._validated(drawn.cell, asked.get("start", drawn.start), asked.get("goal", drawn.goal))

    def drawn(self, rng: np.random.Generator, name: str = "") -> CellInstance:
        """Returns the next instance of the task.

        Raises:
            MmpError: if the task finds none.
            InvalidInstanceError: if start or goal is closer than the margin of the environment, or a tool pose that
                the task draws cannot be reached.
        """
        start, goal, cell = draw(self.cell, self._task, rng)
        if not (are_configurations(start) and are_configurations(goal)):
            return self._validated(cell, start, goal, name)
        instance = self.instance(cell, cast(State, start), cast(State, goal), name=name, margin=self._margin)
        if self._margin is not None:
            _ = instance.problem  # raises if the instance does not keep the margin
        return instance

    def instance(self, cell: Cell, start: State, goal: State, *, name: str, margin: Margin) -> CellInstance:
        """Returns an instance at the speed of the environment, without validation."""
        speed = self._max_velocity
        return CellInstance(cell=cell, start=start, goal=goal, max_velocity=speed, name=name, margin=margin)

    def _validated(self, cell: Cell, start: Asked, goal: Asked, name: str = "") -> CellInstance:
        """Returns an instance with a valid start and goal. Raises like `make_problem`."""
        problem = make_problem(cell, start, goal, max_velocity=self._max_velocity, margin=self._margin, name=name)
        instance = self.instance(cell, problem.start, problem.goal, name=name, margin=self._margin)
        vars(instance)["problem"] = problem  # fills the cached property
        return instance
