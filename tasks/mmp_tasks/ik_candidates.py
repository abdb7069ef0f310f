"""Candidates for the configuration of one arm at a tool target, solved by inverse kinematics on demand.

Inverse kinematics is slow compared with collision queries. Therefore initial guesses are filtered by their clearance
first, and a guess is solved only when the search selects it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm
from mmp_env.model.task import State
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.required_clearance import RequiredClearance

GUESS_TOLERANCE_M = 0.025
"""Clearance that an initial guess may lack [m]. Guesses that lack more rarely have a solution with enough clearance."""
_GROUP = 3
"""Number of guesses in a group; a group is sorted by distance from the present configuration of the arm."""
_MAX_FAILURES = 3
"""Failures of one tilt without a solution after which this tilt counts as out of reach."""
_TILTS = tuple(np.radians([0.0, 25.0, 45.0]).tolist())
_DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class ToolTarget:
    """A target for a tool point in the world [m]; an `upright` target allows no tilt of the tool."""

    point: Float[np.ndarray, "3"]
    upright: bool = True


class IkCandidates:
    """Candidate configurations `q` [n, dof] [rad] of one arm, the preferred ones first.

    A candidate is an initial guess until `solve` replaces it by its solution (`solved`) or marks it as `refused`.

    Args:
        arm: the arm whose tool point is to reach `target`.
        target: the position of the tool point.
        required: the clearance that a solution keeps.
        others: configurations of the arms that are placed already, arm name -> [dof] [rad].
    """

    def __init__(self, arm: Arm, target: ToolTarget, required: RequiredClearance, others: State) -> None:
        self.arm, self._required, self._others = arm, required, others
        self._solver = kinematics(arm.robot, arm.tool)
        T_base_world = np.linalg.inv(arm.T_world_base)
        self._point = T_base_world[:3, :3] @ target.point + T_base_world[:3, 3]
        outward = (target.point - arm.position) * [1.0, 1.0, 0.0]
        outward /= max(float(np.linalg.norm(outward)), 1e-9)
        self._directions = [
            T_base_world[:3, :3] @ (np.cos(tilt) * _DOWN + np.sin(tilt) * outward)
            for tilt in (_TILTS[:1] if target.upright else _TILTS)
        ]
        self._keep(np.empty((0, arm.dof)), np.empty(0, dtype=int))

    def find(self, near: Float[np.ndarray, " dof"], max_count: int, rng: np.random.Generator) -> bool:
        """Collects up to `max_count` initial guesses, and returns whether there are any.

        Guesses with the tool straight down come first, then those tilted away from the base. Guesses close to the
        configuration `near` [rad] are preferred.
        """
        q: list[Float[np.ndarray, "n dof"]] = []
        for direction in self._directions:
            left = max_count - sum(map(len, q))
            if left == 0:
                break
            rows = self._solver.initial_guesses(self._point, direction)
            rows = rows[self._required.slack(self.arm.name, rows, self._others) > -GUESS_TOLERANCE_M][:left]
            rows = rows[rng.permutation(len(rows))]
            distance = np.abs(rows - near).max(axis=1)
            q.append(rows[np.lexsort((distance, np.arange(len(rows)) // _GROUP))])
        self._keep(np.concatenate(q), np.repeat(np.arange(len(q)), [len(rows) for rows in q]))
        return len(self.q) > 0

    def solve(self, k: int) -> None:
        """Replaces candidate `k` by its solution, or marks it as refused."""
        tilt = self._tilts[k]
        q = self._solver.solve(self.q[k], self._point, self._directions[tilt])
        self._outcomes[tilt, 0 if q is None else 1] += 1
        if self._outcomes[tilt].tolist() == [_MAX_FAILURES, 0]:
            self.refused |= self._tilts == tilt
        if q is None or not self._required.is_kept(self.arm.name, q, self._others):
            self.refused[k] = True
        else:
            self.q[k], self.solved[k] = q, True

    def _keep(self, q: Float[np.ndarray, "n dof"], tilts: np.ndarray) -> None:
        self.q, self._tilts = q, tilts
        self._outcomes = np.zeros((len(self._directions), 2), dtype=int)
        """Number of failures and of solutions for each tilt."""
        self.solved: Bool[np.ndarray, " n"] = np.zeros(len(q), dtype=bool)
        self.refused: Bool[np.ndarray, " n"] = np.zeros(len(q), dtype=bool)
