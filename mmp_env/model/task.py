"""The contract of a task: a rule that draws start and goal configurations for a cell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell

State = Mapping[str, Float[np.ndarray, " _dof"]]
"""Configuration of every arm: arm name -> [dof] [rad]. `_dof`, because arms may have different numbers of joints."""


@runtime_checkable
class Task(Protocol):
    """A source of instances, registered under the entry-point group `mmp_env.tasks`.

    The fields of its dataclass are its options, and all have defaults.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State] | tuple[State, State, Cell]:
        """Returns a start and a goal of every arm, both valid and free of collision.

        A task that adds obstacles, or objects in the tools, returns the changed cell as a third value. Arms, robots and
        base poses stay as they are.

        Args:
            cell: the cell without the objects of any task.
            rng: the source of all random numbers. The same state gives the same instance on every machine.

        Raises:
            MmpError: if the task finds no instance in its number of draws.
        """
        ...
