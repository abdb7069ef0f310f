"""Task `pick`: from tucked to grasps above objects on the table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mmp_env.model.cell import Cell
from mmp_tasks.grasping import GraspTask, refuse_holding
from mmp_tasks.stances import home, tucked
from mmp_tasks.task import State


@dataclass(frozen=True, kw_only=True)
class Pick(GraspTask):
    """From the tucked poses to grasps above objects that lie on the table, one for each arm.

    The objects are obstacles named `object-<arm>`.
    """

    called: ClassVar[str] = "pick"

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """A start and a goal, and the cell with the objects. Raises `MmpError` where no draw succeeds."""
        refuse_holding(cell)
        return self.first(cell, lambda _: self._draw(cell, rng))

    def _draw(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        drawn = self.taken(cell, rng, home(cell))
        return self.require(drawn.empty, tucked(cell), "tucked"), drawn.grasps, drawn.empty
