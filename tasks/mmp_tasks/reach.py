"""Task `reach`: random starts and goals with every tool in the space that the arms share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_tasks.drawing import Drawing
from mmp_tasks.shared_space import SharedSpace, shared_space
from mmp_tasks.task import State

_BATCH = 50
"""Candidates drawn at once. A constant, because the stream of random numbers depends on it."""


@dataclass(frozen=True, kw_only=True)
class Reach(Drawing):
    """Random configurations with every tool point in the space that the arms share.

    After the experiments of "Repulsive Trajectory Modification and Conflict Resolution for Efficient Multi-Manipulator
    Motion Planning" (arXiv 2509.13882, 2025), which leave the details open; these are ours.

    An arm's configuration is uniform in the robot's draw limits and accepted when its tool point lies in the shared
    space, the arm is at least `static_clearance` [m] clear of obstacles, other bases and itself, and at least
    `clearance` [m] of the arms drawn before it, their bases included. After `tries` refused configurations of one arm
    the draw starts anew; after `draws` such draws it is an error.

    Draws are NumPy float64, and distances are the exact ones, so that an instance depends on no processor.
    """

    called: ClassVar[str] = "reach"
    tries: int = 300
    draws: int = 100

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """A start and a goal, drawn one after the other. Raises `MmpError` where no draw succeeds."""
        space = shared_space(cell)
        return self._state(cell, space, rng, "start"), self._state(cell, space, rng, "goal")

    def _state(self, cell: Cell, space: SharedSpace, rng: np.random.Generator, which: str) -> State:
        refused: Counter[str] = Counter()
        for _ in range(self.draws):
            drawn: dict[str, Float[np.ndarray, " dof"]] = {}
            for arm in cell.arms:
                q = self._configuration(cell, arm, space, drawn, rng)
                if q is None:
                    refused[arm.name] += 1
                    break
                drawn[arm.name] = q
            else:
                return drawn
        hardest, times = refused.most_common(1)[0]
        raise MmpError(
            f"task '{self.called}' found no {which} for cell '{cell.name}' in {self.draws} draws: {times} of them ended"
            f" at arm '{hardest}', none of whose {self.tries} random configurations had its tool point within"
            f" {space.radius:.2f} m of ({space.center[0]:.2f}, {space.center[1]:.2f}) at a height of"
            f" {space.bottom:.2f} to {space.top:.2f} m, and was {self.clearance * 1e3:g} mm clear of the arms drawn"
            f" before it and {self.static_clearance * 1e3:g} mm of everything else"
        )

    def _configuration(
        self, cell: Cell, arm: Arm, space: SharedSpace, drawn: State, rng: np.random.Generator
    ) -> Float[np.ndarray, " dof"] | None:
        """The first acceptable of `tries` configurations [dof] beside the arms in `drawn`; None if there is none."""
        robot, queries = arm.robot, cell.collision
        for begin in range(0, self.tries, _BATCH):
            # Not rng.uniform, whose product and sum are one rounding on some processors and two on others.
            share = rng.random((min(_BATCH, self.tries - begin), arm.dof))
            q = robot.draw_upper - share * (robot.draw_upper - robot.draw_lower)
            q = q[space.contains(queries.tool_points(arm.name, q))]
            q = q[queries.static_clearance(arm.name, q, precise=True) >= self.static_clearance]
            for other, q_other in drawn.items():
                others = np.repeat(q_other[None], len(q), axis=0)
                q = q[queries.pair_clearance(arm.name, q, other, others, precise=True) >= self.clearance]
            if len(q):
                return frozen_array(q[0])
        return None
