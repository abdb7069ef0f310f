"""The contract of a task: a rule that draws start and goal configurations for a cell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.model.goals import GivenGoal

State = Mapping[str, Float[np.ndarray, " _dof"]]
"""Configuration of every arm: arm name -> [dof] [rad]. `_dof`, because arms may have different numbers of joints."""

Asked = Mapping[str, GivenGoal]
"""The goal of every arm: arm name -> a configuration [dof] [rad] or another goal, such as a `PoseGoal`."""


@runtime_checkable
class Task(Protocol):
    """A source of instances, registered under the entry-point group `mmp_env.tasks`.

    The fields of its dataclass are its options, and all have defaults.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[Asked, Asked] | tuple[Asked, Asked, Cell]:
        """Returns a start and a goal of every arm, both valid and free of collision.

        They are configurations, or what `make_problem` takes as `start` and `goal`, such as `PoseGoal`s.

        A task that adds obstacles, or objects in the tools, returns the changed cell as a third value. Arms, robots and
        base poses stay as they are.

        Args:
            cell: the cell without the objects of any task.
            rng: the source of all random numbers. The same state gives the same instance on every machine.

        Raises:
            MmpError: if the task finds no instance in its number of draws.
        """
        ...
