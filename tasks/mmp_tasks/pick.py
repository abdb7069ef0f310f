"""Task `pick`: from tucked to grasps above objects on the table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env.model.cell import Cell
from mmp_env.model.task import State
from mmp_tasks import grasping
from mmp_tasks.configuration_search import ConfigurationSearch, home, tucked
from mmp_tasks.draw_options import DrawOptions, draw_until_success


@dataclass(frozen=True, kw_only=True)
class Pick(DrawOptions):
    """From the tucked poses to grasps above objects that lie on the table, one for each arm.

    The objects are obstacles named `object-<arm>`.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """Returns start, goal, and the cell with the objects. Raises `MmpError` if no draw succeeds."""
        grasping.require_empty_tools(cell)
        search = ConfigurationSearch(cell=cell, options=self, rng=rng)
        return draw_until_success(self, cell, lambda _: _draw(search))


def _draw(search: ConfigurationSearch) -> tuple[State, State, Cell]:
    drawn = grasping.draw_grasps(search, home(search.cell))
    start = search.within(drawn.empty).require(tucked(drawn.empty), "tucked")
    return start, drawn.grasps, drawn.empty
