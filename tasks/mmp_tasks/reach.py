"""Task `reach`: random starts and goals with every tool in the space that the arms share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.task import State
from mmp_tasks.alone import arm_without_path
from mmp_tasks.draw_options import DrawFailed, DrawOptions, draw_until_success

INSET_M = 0.15
"""Distance between the shared space and the ring of bases."""
MIN_RADIUS_M = 0.20
"""Smallest radius of the shared space. A ring of two short arms, 0.29 m wide, would otherwise leave 0.14 m."""
LOWEST_M, HIGHEST_M = 0.05, 0.80
"""Height of the shared space above the lowest base, which is assumed to stand on the table."""
_BATCH = 50
"""Number of configurations that are drawn at once. The stream of random numbers depends on it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedSpace:
    """An upright cylinder: `center` [2], `radius`, and from `bottom` to `top` along z [m]."""

    center: Float[np.ndarray, " 2"]
    radius: float
    bottom: float
    top: float

    def __str__(self) -> str:
        x, y = self.center
        return f"within {self.radius:.2f} m of ({x:.2f}, {y:.2f}) at a height of {self.bottom:.2f} to {self.top:.2f} m"

    def contains(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Returns which points of the world are in the space or on its surface."""
        aside = points[:, :2] - self.center
        beside = aside[:, 0] ** 2 + aside[:, 1] ** 2 <= self.radius**2
        return beside & (points[:, 2] >= self.bottom) & (points[:, 2] <= self.top)


@dataclass(frozen=True, kw_only=True)
class Reach(DrawOptions):
    """Random configurations with every tool point in the space that the arms share.

    After the experiments of "Repulsive Trajectory Modification and Conflict Resolution for Efficient Multi-Manipulator
    Motion Planning" (arXiv 2509.13882, 2025). The paper leaves the details open; they are our design decisions.

    The configuration of an arm is uniform in the draw limits of its robot. The task accepts it when the tool point is
    in the shared space and the arm keeps `static_clearance` [m] from obstacles, other bases and itself, and `clearance`
    [m] from the arms drawn before it, bases included. When the task refuses `tries` configurations of one arm, it
    begins a new draw; after `draws` draws it raises an error. It also draws again if an arm finds no path from its
    start to its goal even alone.

    Draws and distances are computed in double precision, so that no instance depends on the processor.
    """

    tries: int = 300
    draws: int = 100

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal, drawn one after the other. Raises `MmpError` if no draw succeeds."""
        space = shared_space(cell)
        return draw_until_success(self, cell, lambda _: self._instance(cell, space, rng))

    def _instance(self, cell: Cell, space: SharedSpace, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal. Raises `DrawFailed` if an arm finds no path between them even alone."""
        start, goal = self._state(cell, space, rng, "start"), self._state(cell, space, rng, "goal")
        cut_off = arm_without_path(cell, start, goal)
        if cut_off is not None:
            raise DrawFailed.at(cut_off, ", which finds no path from its start to its goal even alone")
        return start, goal

    def _state(self, cell: Cell, space: SharedSpace, rng: np.random.Generator, which: str) -> State:
        failed: list[tuple[Arm, State]] = []
        for _ in range(self.draws):
            drawn: dict[str, Float[np.ndarray, " dof"]] = {}
            for arm in cell.arms:
                q = self._configuration(cell, arm, space, drawn, rng)
                if q is None:
                    failed.append((arm, drawn))
                    break
                drawn[arm.name] = q
            else:
                return drawn
        name, times = Counter(arm.name for arm, _ in failed).most_common(1)[0]
        arm, others = next((arm, drawn) for arm, drawn in failed if arm.name == name)
        raise MmpError(
            f"task '{self.name}' found no {which} for cell '{cell.name}' in {self.draws} draws: {times} of them ended"
            f" at arm '{name}'. Its {self.tries} random configurations per draw must have a tool point {space}, and be"
            f" {self.clearance * 1e3:g} mm clear of the arms drawn before it and {self.static_clearance * 1e3:g} mm of"
            f" everything else; {self._obstruction(cell, arm, space, others)}"
        )

    def _configuration(
        self, cell: Cell, arm: Arm, space: SharedSpace, drawn: State, rng: np.random.Generator
    ) -> Float[np.ndarray, " dof"] | None:
        """Returns the first accepted configuration [dof] [rad] beside the arms in `drawn`, or None."""
        queries = cell.collision
        for q in self._in_space(cell, arm, space, rng):
            q = q[queries.static_clearance(arm.name, q, precise=True) >= self.static_clearance]
            for other, q_other in drawn.items():
                others = np.repeat(q_other[None], len(q), axis=0)
                q = q[queries.pair_clearance(arm.name, q, other, others, precise=True) >= self.clearance]
            if len(q):
                return frozen_array(q[0])
        return None

    def _in_space(
        self, cell: Cell, arm: Arm, space: SharedSpace, rng: np.random.Generator
    ) -> Iterator[Float[np.ndarray, "n dof"]]:
        """Yields `tries` random configurations [rad] in batches, less those with a tool point outside the space."""
        robot = arm.robot
        for begin in range(0, self.tries, _BATCH):
            # rng.uniform rounds its product and sum once on some processors and twice on others.
            share = rng.random((min(_BATCH, self.tries - begin), arm.dof))
            q = robot.draw_upper - share * (robot.draw_upper - robot.draw_lower)
            yield q[space.contains(cell.collision.tool_points(arm.name, q))]

    def _obstruction(self, cell: Cell, arm: Arm, space: SharedSpace, drawn: State) -> str:
        """Returns in words what obstructs most random configurations of an arm beside the arms in `drawn`."""
        rows = np.concatenate(list(self._in_space(cell, arm, space, np.random.default_rng(0))))
        if not len(rows):
            return "its tool point never is in that space"
        placed = replace(cell, arms=(*(cell.arm(name) for name in drawn), arm)).collision
        required = {"arms": self.clearance, "obstacles": self.static_clearance, "self": self.static_clearance}
        close = Counter[str]()
        for q in rows:
            near = placed.nearest({**drawn, arm.name: q})
            close.update(near[kind].bodies for kind in near if near[kind].clearance_m < required[kind])
        pair = close.most_common(1)[0][0] if close else f"{arm.name} and the base of another arm"
        return f"the bodies that are most often too close are {pair}"


def shared_space(cell: Cell) -> SharedSpace:
    """Returns the shared space of a cell of any layout.

    Its centre is the mean of the bases. Its radius is their mean horizontal distance from the centre less `INSET_M`,
    and at least `MIN_RADIUS_M`. A single arm has a radius of its whole reach.
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
