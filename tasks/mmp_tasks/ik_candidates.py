"""Ways to a place: the configurations with which one arm may bring its tool there, beside others that stand already.

Inverse kinematics is slow beside collision queries. So what it would begin at is looked at first, and is solved only
when a search comes to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.model.arm import Arm
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.room import Room
from mmp_tasks.task import State

NEARLY_M = 0.025
"""What lacks more room than this where inverse kinematics begins hardly ever has it where that ends."""
_COMPARED = 3
"""Of so many beginnings, the one nearest to where the arm comes from is tried first."""
_OUT_OF_REACH = 3
"""When so many of one tilt lead to no solution, and none has led to one, there is none."""
_TILTS = tuple(np.radians([0.0, 25.0, 45.0]).tolist())
_DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class ToolTarget:
    """Where a tool point shall be in the world [m]; `upright`: the tool points straight down, not nearly so."""

    point: Float[np.ndarray, "3"]
    upright: bool = True


class Ways:
    """Of each way `q` [n, dof] [rad], early ones rather: where to begin, or the solution once that is `solved`.

    A way is `refused` when it turns out to lead to no solution, or to one without room.
    """

    def __init__(self, arm: Arm, place: ToolTarget, room: Room, beside: State) -> None:
        self.arm, self._room, self._beside = arm, room, beside
        self._solver = kinematics(arm.robot, arm.tool)
        T_base_world = np.linalg.inv(arm.T_world_base)
        self._point = T_base_world[:3, :3] @ place.point + T_base_world[:3, 3]
        outward = (place.point - arm.position) * [1.0, 1.0, 0.0]
        outward /= max(float(np.linalg.norm(outward)), 1e-9)
        self._directions = [
            T_base_world[:3, :3] @ (np.cos(tilt) * _DOWN + np.sin(tilt) * outward)
            for tilt in (_TILTS[:1] if place.upright else _TILTS)
        ]
        self._keep(np.empty((0, arm.dof)), np.empty(0, dtype=int))

    def find(self, near: Float[np.ndarray, " dof"], most: int, rng: np.random.Generator) -> bool:
        """Looks for at most so many, and those near to `near` rather; False where there are none.

        Straight down first; tilted away from the base where that leaves too few.
        """
        q: list[Float[np.ndarray, "n dof"]] = []
        for direction in self._directions:
            left = most - sum(map(len, q))
            if left == 0:
                break
            rows = self._solver.beginnings(self._point, direction)
            rows = rows[self._room.slack(self.arm.name, rows, self._beside) > -NEARLY_M][:left]
            rows = rows[rng.permutation(len(rows))]
            far = np.abs(rows - near).max(axis=1)
            q.append(rows[np.lexsort((far, np.arange(len(rows)) // _COMPARED))])
        self._keep(np.concatenate(q), np.repeat(np.arange(len(q)), [len(rows) for rows in q]))
        return len(self.q) > 0

    def solve(self, k: int) -> None:
        """Puts the solution in the place of way `k`, or refuses it."""
        tilt = self._tilts[k]
        q = self._solver.solved(self.q[k], self._point, self._directions[tilt])
        self._tried[tilt, 0 if q is None else 1] += 1
        if self._tried[tilt].tolist() == [_OUT_OF_REACH, 0]:
            self.refused |= self._tilts == tilt
        if q is None or not self._room.has(self.arm.name, q, self._beside):
            self.refused[k] = True
        else:
            self.q[k], self.solved[k] = q, True

    def _keep(self, q: Float[np.ndarray, "n dof"], tilts: np.ndarray) -> None:
        self.q, self._tilts = q, tilts
        self._tried = np.zeros((len(self._directions), 2), dtype=int)
        """Of each tilt: without and with a solution."""
        self.solved: Bool[np.ndarray, " n"] = np.zeros(len(q), dtype=bool)
        self.refused: Bool[np.ndarray, " n"] = np.zeros(len(q), dtype=bool)
