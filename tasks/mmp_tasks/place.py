"""Task `place`: every arm brings the object in its tool over a tray."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.model.task import State
from mmp_tasks import grasping
from mmp_tasks.configuration_search import ConfigurationSearch, home
from mmp_tasks.draw_options import DrawFailed, DrawOptions, draw_until_success
from mmp_tasks.table import Sector, Table

TRAY_M = (0.12, 0.12, 0.02)
"""Edges of a tray."""
_WIDE = Sector(nearest=0.35, farthest=0.80, aside=1.3)
"""Sector for trays far from where the object was, also behind those of other arms."""
_TRAY_DRAWS = 4
_MAX_ARMS_WIDE = 4
"""Largest number of arms with enough room for the wide sector."""


@dataclass(frozen=True, kw_only=True)
class Place(DrawOptions):
    """From grasps to above trays, every arm with an object in its tool and a tray of its own.

    The trays are obstacles named `tray-<arm>`. The objects come from where `pick` leaves the arms.
    """

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """Returns start, goal, and the cell with trays and held objects. Raises `MmpError` if no draw succeeds."""
        return self.deliver(cell, rng).instance

    def deliver(self, cell: Cell, rng: np.random.Generator) -> grasping.Delivery:
        """Returns the same instance with the cells before and after it. Raises like `sample`."""
        grasping.require_empty_tools(cell)
        search = ConfigurationSearch(cell=cell, options=self, rng=rng)
        return draw_until_success(self, cell, lambda _: _draw(search))


def _draw(search: ConfigurationSearch) -> grasping.Delivery:
    drawn, table = grasping.draw_grasps(search, home(search.cell)), Table(search.cell)
    spots, goal = _draw_trays(search.within(drawn.full), drawn)
    middle = table.height + TRAY_M[2] / 2
    trays = [grasping.solid_box(f"tray-{name}", np.append(spot, middle), TRAY_M) for name, spot in spots.items()]
    rest = {name: np.append(spot, table.height + TRAY_M[2]) for name, spot in spots.items()}
    return grasping.make_delivery(search, drawn, goal, rest, trays)


def _draw_trays(
    search: ConfigurationSearch, drawn: grasping.Grasps
) -> tuple[dict[str, Float[np.ndarray, " 2"]], State]:
    """Returns the tray of each arm and the goal. Draws the trays several times, because the grasps were hard to find.

    Raises `DrawFailed`.
    """
    table, heights = (
        Table(drawn.empty),
        (TRAY_M[2], TRAY_M[2] + grasping.ABOVE_M + grasping.OBJECT_M[2] + grasping.GAP_M),
    )
    sectors: Sequence[Sector] = (Sector(), _WIDE) if len(search.cell.arms) <= _MAX_ARMS_WIDE else (Sector(),)
    for _ in range(_TRAY_DRAWS - 1):
        with contextlib.suppress(DrawFailed):
            return grasping.draw_spots(search, table, heights, drawn.grasps, sectors)
    return grasping.draw_spots(search, table, heights, drawn.grasps, sectors)
