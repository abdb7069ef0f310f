"""The space that the arms of a cell share: an upright cylinder in the middle of their bases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.cell import Cell

INSET_M = 0.15
"""The cylinder ends this far before the ring of bases."""
MIN_RADIUS_M = 0.20
"""Never narrower, however close the bases stand: at the 0.29 m of a ring of two short arms 0.14 m would be left."""
LOWEST_M, HIGHEST_M = 0.05, 0.80
"""Above the table, which is taken to be where the lowest base stands."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedSpace:
    """An upright cylinder: `center` [2], `radius`, and from `bottom` to `top` along z [m]."""

    center: Float[np.ndarray, " 2"]
    radius: float
    bottom: float
    top: float

    def contains(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Which points of the world lie in it, its surface included."""
        aside = points[:, :2] - self.center
        beside = aside[:, 0] ** 2 + aside[:, 1] ** 2 <= self.radius**2
        return beside & (points[:, 2] >= self.bottom) & (points[:, 2] <= self.top)


def shared_space(cell: Cell) -> SharedSpace:
    """The shared space of a cell of any layout.

    Its centre is the mean of the bases. Its radius is their mean horizontal distance from there, which in a ring is the
    radius of the ring, less `INSET_M`, at least `MIN_RADIUS_M`. A single arm has its whole reach to itself.
    """
    bases = np.array([arm.position for arm in cell.arms])
    center = bases[:, :2].mean(axis=0)
    if len(cell.arms) == 1:
        radius = cell.arms[0].robot.reach
    else:
        ring_radius = float(np.linalg.norm(bases[:, :2] - center, axis=1).mean())
        radius = max(ring_radius - INSET_M, MIN_RADIUS_M)
    table = float(bases[:, 2].min())
    return SharedSpace(center=center, radius=radius, bottom=table + LOWEST_M, top=table + HIGHEST_M)
