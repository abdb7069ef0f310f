"""What a task is: a rule by which start and goal configurations are drawn for a cell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell

State = Mapping[str, Float[np.ndarray, " _dof"]]
"""A configuration of every arm: arm name -> [dof] [rad]; `_dof`, because arms may differ in their number of joints."""


@runtime_checkable
class Task(Protocol):
    """A source of instances, registered under the entry-point group `mmp_env.tasks`.

    Its options are the fields of its dataclass, all with defaults.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State] | tuple[State, State, Cell]:
        """A start and a goal of every arm, both valid and free of collision.

        A task that changes the cell, by obstacles or by what arms hold, also gives the cell that the two are valid in;
        arms, robots and base poses stay as they are.

        The same state of `rng` gives the same pair on every machine. Raises `MmpError` where the cell has room for
        none within the stated number of tries.
        """
        ...
