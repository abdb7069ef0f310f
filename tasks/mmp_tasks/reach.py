"""Task `reach`: random starts and goals with every tool in space that arms share."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import frozen_array
from mmp_env.model.task import State
from mmp_tasks.alone import has_path_alone
from mmp_tasks.draw_options import DrawFailed, DrawOptions, draw_until_success
from mmp_tasks.shared_space import Middle, Space, has_open_middle, middle, neighbourhood, neighbours

_BATCH = 50
"""Number of configurations that are drawn at once. The stream of random numbers depends on it."""
_MOST_PATHLESS = 10
"""Number of goals of an arm without a path from its start, after which all starts are drawn again."""
_MORE_TRIES = 20
_NO_PATH = ", which finds no path from its start to its goal even alone"


@dataclass(frozen=True, kw_only=True)
class Reach(DrawOptions):
    """Random configurations with every tool point in space that arms share.

    After the experiments of "Repulsive Trajectory Modification and Conflict Resolution for Efficient Multi-Manipulator
    Motion Planning" (arXiv 2509.13882, 2025). The paper leaves the details open; they are our design decisions.

    In a cell whose arms stand around an empty middle, such as a ring, that middle is the shared space. In any other
    cell each arm has a space of its own: points that two other arms reach as well, or one if it has one neighbour.

    The configuration of an arm is uniform in the draw limits of its robot. The task accepts it when the tool point is
    in the shared space and the arm keeps `static_clearance` [m] from obstacles, other bases and itself, and `clearance`
    [m] from the arms drawn before it, bases included. When the task refuses `tries` configurations of one arm, it
    draws again, all arms around an empty middle, otherwise the neighbours of that arm. After `draws` times it does all
    that again with 20 times as many `tries`, for arms that seldom reach the space, and then raises an error. It also
    draws again if an arm finds no path from its start to its goal even alone.

    Draws and distances are computed in double precision, so that no instance depends on the processor.
    """

    tries: int = 300
    draws: int = 100

    def sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal, drawn one after the other. Raises `MmpError` if no draw succeeds."""
        try:
            return self._sample(cell, rng)
        except MmpError as failure:
            if _NO_PATH in str(failure):
                raise
            return replace(self, tries=_MORE_TRIES * self.tries)._sample(cell, rng)

    def _sample(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        if not has_open_middle(cell):
            return draw_until_success(self, cell, lambda _: self._beside_neighbours(cell, rng))
        space = middle(cell)
        return draw_until_success(self, cell, lambda _: self._instance(cell, space, rng))

    def _instance(self, cell: Cell, space: Middle, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal. Raises `DrawFailed` if an arm finds no path between them even alone."""
        start, goal = self._state(cell, space, rng, "start"), self._state(cell, space, rng, "goal")
        for arm in cell.arms:
            if not has_path_alone(cell, arm.name, start[arm.name], goal[arm.name]):
                raise DrawFailed.at(arm, _NO_PATH)
        return start, goal

    def _beside_neighbours(self, cell: Cell, rng: np.random.Generator) -> tuple[State, State]:
        """Returns a start and a goal with every tool point in the space that its arm shares with its neighbours.

        Raises `DrawFailed` if an arm finds no path from its start to several goals even alone.
        """
        spaces = {arm.name: neighbourhood(cell, arm) for arm in cell.arms}
        near = {arm.name: [other.name for other in neighbours(cell, arm)] for arm in cell.arms}

        def draw(which: str, start: State | None) -> State:
            drawn: dict[str, Float[np.ndarray, " dof"]] = {}
            waiting, failures, pathless = deque(cell.arm_names), Counter[str](), Counter[str]()
            while waiting:
                name = waiting.popleft()
                others = {other: drawn[other] for other in near[name] if other in drawn}
                q = self._configuration(cell, cell.arm(name), spaces[name], others, rng)
                if q is not None and (start is None or has_path_alone(cell, name, start[name], q)):
                    drawn[name] = q
                    continue
                pathless[name] += q is not None
                if pathless[name] == _MOST_PATHLESS:
                    raise DrawFailed.at(cell.arm(name), _NO_PATH)
                failures[name] += 1
                if failures[name] == self.draws:
                    raise self._gave_up(cell, cell.arm(name), spaces[name], others, which, self.draws)
                for other in others:
                    del drawn[other]
                waiting.extendleft([*reversed(others), name])
            return {name: drawn[name] for name in cell.arm_names}

        start = draw("start", None)
        return start, draw("goal", start)

    def _state(self, cell: Cell, space: Middle, rng: np.random.Generator, which: str) -> State:
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
        raise self._gave_up(cell, arm, space, others, which, times)

    def _gave_up(self, cell: Cell, arm: Arm, space: Space, others: State, which: str, times: int) -> MmpError:
        return MmpError(
            f"task '{self.name}' found no {which} for cell '{cell.name}' in {self.draws} draws: {times} of them ended"
            f" at arm '{arm.name}'. Its {self.tries} random configurations per draw must have a tool point {space}, and"
            f" be {self.clearance * 1e3:g} mm clear of the arms drawn before it and"
            f" {self.static_clearance * 1e3:g} mm of everything else; {self._obstruction(cell, arm, space, others)}"
        )

    def _configuration(
        self, cell: Cell, arm: Arm, space: Space, drawn: State, rng: np.random.Generator
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
        self, cell: Cell, arm: Arm, space: Space, rng: np.random.Generator
    ) -> Iterator[Float[np.ndarray, "n dof"]]:
        """Yields `tries` random configurations [rad] in batches, less those with a tool point outside the space."""
        robot = arm.robot
        for begin in range(0, self.tries, _BATCH):
            # rng.uniform rounds its product and sum once on some processors and twice on others.
            share = rng.random((min(_BATCH, self.tries - begin), arm.dof))
            q = robot.draw_upper - share * (robot.draw_upper - robot.draw_lower)
            yield q[space.contains(cell.collision.tool_points(arm.name, q))]

    def _obstruction(self, cell: Cell, arm: Arm, space: Space, drawn: State) -> str:
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
