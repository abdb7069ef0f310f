"""Task `pick`: from tucked to grasps above objects on the table."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from mmp_env.cell import Cell
from mmp_tasks.handling import Handler, refuse_holding
from mmp_tasks.stances import Missed, gave_up, home, tucked
from mmp_tasks.task import State


@dataclass(frozen=True, kw_only=True)
class Pick(Handler):
    """From the tucked poses to grasps above objects that lie on the table, one for each arm.

    The objects are obstacles named `object-<arm>`.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """A start and a goal, and the cell with the objects. Raises `MmpError` where no draw succeeds."""
        refuse_holding(cell)
        misses = Counter[str]()
        for _ in range(self.draws):
            try:
                drawn = self.taken(cell, rng, home(cell))
                return self.require(drawn.empty, tucked(cell), "tucked"), drawn.grasps, drawn.empty
            except Missed as miss:
                misses[str(miss)] += 1
        raise gave_up("pick", cell, self.draws, misses)
