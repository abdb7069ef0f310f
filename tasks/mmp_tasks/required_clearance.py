"""The clearance that start and goal of an instance must keep in a cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.model.task import State
from mmp_tasks.draw_options import DrawOptions


@dataclass(frozen=True, kw_only=True, eq=False)
class RequiredClearance:
    """A cell, and the options of a task with the clearances that its arms keep.

    Distances are computed in double precision, so that no decision depends on the processor.
    """

    cell: Cell
    options: DrawOptions

    def slack(self, arm: str, q: Float[np.ndarray, "n dof"], others: State) -> Float[np.ndarray, " n"]:
        """Returns the clearance beyond the required one [m] of an arm at `q` [rad] beside the arms in `others`."""
        least = self.cell.collision.static_clearance(arm, q, precise=True) - self.options.static_clearance
        for other, q_other in others.items():
            least = np.minimum(least, self.slack_between(arm, q, other, q_other[None])[:, 0])
        return least

    def slack_between(
        self, arm_a: str, q_a: Float[np.ndarray, "n dof_a"], arm_b: str, q_b: Float[np.ndarray, "m dof_b"]
    ) -> Float[np.ndarray, "n m"]:
        """Returns the clearance beyond the required one [m] for each pair of configurations [rad] of two arms."""
        rows_a, rows_b = np.repeat(q_a, len(q_b), axis=0), np.tile(q_b, (len(q_a), 1))
        distance = self.cell.collision.pair_clearance(arm_a, rows_a, arm_b, rows_b, precise=True)
        return distance.reshape(len(q_a), len(q_b)) - self.options.clearance

    def is_kept(self, arm: str, q: Float[np.ndarray, " dof"], others: State) -> bool:
        """Returns whether an arm at `q` [rad] is within its limits and keeps the clearance beside `others`."""
        within = bool(self.cell.collision.within_limits(arm, q[None])[0])
        return within and bool(self.slack(arm, q[None], others)[0] >= 0)
