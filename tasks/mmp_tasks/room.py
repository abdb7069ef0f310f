"""Room: how much more of it arms have in a cell than the clearances that a task asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_tasks.task import State


@dataclass(frozen=True, kw_only=True, eq=False)
class Room:
    """A cell in which arms shall be `clearance` [m] clear of each other and `static_clearance` [m] of all else.

    Distances are the exact ones, so that no decision depends on the processor.
    """

    cell: Cell
    clearance: float
    static_clearance: float

    def slack(self, arm: str, q: Float[np.ndarray, "n dof"], beside: State) -> Float[np.ndarray, " n"]:
        """Least clearance beyond what is asked for [m] of one arm at `q` [rad] with others at `beside`."""
        least = self.cell.collision.static_clearance(arm, q, precise=True) - self.static_clearance
        for other, q_other in beside.items():
            least = np.minimum(least, self.slack_between(arm, q, other, q_other[None])[:, 0])
        return least

    def slack_between(
        self, one: str, q_one: Float[np.ndarray, "n dof_a"], other: str, q_other: Float[np.ndarray, "m dof_b"]
    ) -> Float[np.ndarray, "n m"]:
        """Clearance beyond what is asked for [m] of two arms, each configuration of one with each of the other."""
        rows = np.repeat(q_one, len(q_other), axis=0), np.tile(q_other, (len(q_one), 1))
        apart = self.cell.collision.pair_clearance(one, rows[0], other, rows[1], precise=True)
        return apart.reshape(len(q_one), len(q_other)) - self.clearance

    def has(self, arm: str, q: Float[np.ndarray, " dof"], beside: State) -> bool:
        """Whether an arm at `q` [rad] is within its limits and keeps the clearances."""
        within = bool(self.cell.collision.within_limits(arm, q[None])[0])
        return within and bool(self.slack(arm, q[None], beside)[0] >= 0)
