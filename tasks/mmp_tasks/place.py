"""Task `place`: what the arms hold is brought over trays."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_tasks.drawing import DrawFailed
from mmp_tasks.grasping import ABOVE_M, GAP_M, OBJECT_M, Delivery, GraspTask, Handling, refuse_holding, solid_box
from mmp_tasks.stances import home
from mmp_tasks.table import Sector, Table
from mmp_tasks.task import State

TRAY_M = (0.12, 0.12, 0.02)
"""Edges of a tray."""
_WIDE = Sector(nearest=0.35, farthest=0.80, aside=1.3)
"""Trays may be far from where the object was, and behind those of other arms."""
_TRAYS = 4
_FEW = 4
"""With more arms there is no room for that."""


@dataclass(frozen=True, kw_only=True)
class Place(GraspTask):
    """From grasps to above trays, every arm with an object in its tool and a tray of its own.

    The trays are obstacles named `tray-<arm>`. The objects come from where `pick` leaves the arms.
    """

    called: ClassVar[str] = "place"

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State, Cell]:
        """A start and a goal, and the cell with the trays and what is held. Raises `MmpError` for no success."""
        drawn = self.deliver(cell, rng)
        return drawn.grasps, drawn.releases, drawn.during

    def deliver(self, cell: Cell, rng: np.random.Generator) -> Delivery:
        """The same, and what is before and after. Raises `MmpError` where no draw succeeds."""
        refuse_holding(cell)
        return self.first(cell, lambda _: self._draw(cell, rng))

    def _draw(self, cell: Cell, rng: np.random.Generator) -> Delivery:
        drawn, table = self.taken(cell, rng, home(cell)), Table(cell)
        sectors = (Sector(), _WIDE) if len(cell.arms) <= _FEW else (Sector(),)
        rise = TRAY_M[2] + ABOVE_M + OBJECT_M[2] + GAP_M
        spots, goal = self._trays(drawn, rise, sectors, rng)
        middle = table.height + TRAY_M[2] / 2
        trays = [solid_box(f"tray-{name}", np.append(spot, middle), TRAY_M) for name, spot in spots.items()]
        rest = {name: np.append(spot, table.height + TRAY_M[2]) for name, spot in spots.items()}
        return self.delivery(drawn, trays, rest, goal)

    def _trays(
        self, drawn: Handling, rise: float, sectors: Sequence[Sector], rng: np.random.Generator
    ) -> tuple[dict[str, Float[np.ndarray, " 2"]], State]:
        """Places for the trays, tried several times: the objects were as hard to find. Raises `DrawFailed`."""
        table = Table(drawn.empty)
        for _ in range(_TRAYS - 1):
            with contextlib.suppress(DrawFailed):
                return self.scattered(drawn.full, table, (TRAY_M[2], rise), rng, drawn.grasps, sectors)
        return self.scattered(drawn.full, table, (TRAY_M[2], rise), rng, drawn.grasps, sectors)
