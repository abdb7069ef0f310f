"""Plans the path of one arm among other arms that stand still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR, levels_of
from mmp_env.model.goals import Goal, Stay
from mmp_env.model.problem import Problem
from mmp_env.problems.candidates import are_free_alone, candidates, in_collision, what_blocks
from mmp_planners.goal_choice import few, nearest
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import MOST_GOALS
from mmp_planners.seeds import quick_seed_of
from mmp_planners.work.handling import Handling


class MovePlanner:
    """The single-arm planner SI-RRT* from where an arm stands, among other arms that stand still.

    Args:
        handling: the objects; its `problem` is the one to plan in.
        slack: what paths keep beyond the margins, so that the proof ends [m].
        dt: time of a step of the path at full speed [s].
        low_level: single-arm planner.
        seed: seed of all calls.
        clock: deadline.

    Attributes:
        calls: number of calls so far.
    """

    def __init__(
        self, handling: Handling, slack: float, dt: float, low_level: SiRrtStar, seed: int, clock: core.Clock
    ) -> None:
        self._handling, self.clock, self.calls = handling, clock, 0
        self._slack, self._dt, self._low_level, self._seed = slack, dt, low_level, seed
        self._names = handling.bare.cell.arm_names
        self._levels = levels_of(handling.bare.margins, SEARCH_MARGIN_FACTOR * slack, PLAN_MARGIN_FACTOR * slack)

    @property
    def problem(self) -> Problem:
        """The problem to plan in: cell with objects, velocity limits and margins."""
        return self._handling.problem

    def goals(self, arm: int, goal: Goal, near: Float[np.ndarray, "dof"], where: str) -> Float[np.ndarray, "n dof"]:
        """Returns the configurations of a goal that are free alone, the nearest first.

        Args:
            arm: number of the arm.
            goal: what is asked for.
            near: where the arm stands [rad].
            where: begin of the messages, such as `job 'a', step 1`.

        Raises:
            InvalidInstanceError: if there are none.
        """
        return self.free_of(arm, self.configurations(arm, goal, near, where), goal, where)

    def configurations(
        self, arm: int, goal: Goal, near: Float[np.ndarray, "dof"], where: str
    ) -> Float[np.ndarray, "n dof"]:
        """Returns all configurations of a goal, the nearest first; see `goals`."""
        if isinstance(goal, Stay):
            return np.array(near)[None]
        return candidates(self.problem.cell.arms[arm], goal, near, where).q

    def free_of(self, arm: int, rows: Float[np.ndarray, "n dof"], goal: Goal, where: str) -> Float[np.ndarray, "m dof"]:
        """Returns the configurations of a goal that are free alone. Raises `InvalidInstanceError` if none is."""
        cell = self.problem.cell
        free = rows if isinstance(goal, Stay) else self.free_alone(arm, rows)
        if not len(free):
            raise in_collision(where, len(rows), what_blocks(cell, cell.arms[arm], rows, self.problem.margins))
        return free

    def free_alone(self, arm: int, rows: Float[np.ndarray, "n dof"]) -> Float[np.ndarray, "m dof"]:
        """Returns the configurations that keep the margins, and room to plan in, without the other arms."""
        cell, problem = self.problem.cell, self.problem
        return rows[are_free_alone(cell, cell.arms[arm], rows, problem.margins, self._slack)]

    def plan(
        self,
        arm: int,
        start: Float[np.ndarray, "dof"],
        goals: Float[np.ndarray, "n dof"],
        others: Sequence[core.Motion],
        budget: float = 1.0,
    ) -> Float[np.ndarray, "k dof"] | None:
        """Returns configurations [k, dof] [rad] of a path from a start to a goal, clear of others; or None."""
        self.calls += 1
        seed = quick_seed_of(self._seed, self.calls)
        some = few(goals, MOST_GOALS)
        single = core.SingleArm(
            self.problem.cell.collision.core,
            arm,
            start=np.ascontiguousarray(start),
            goals=some,
            max_step=self.problem.max_velocity[self._names[arm]] * self._dt,
            levels=self._levels,
            seed=seed,
            eta=self._low_level.eta,
        )
        rows, _ = self._low_level(single, (), seed, budget, self.clock, others=others)
        return None if rows is None else self._with_exact_ends(arm, rows, start, some)

    def edges_free(self, arm: int, path: Float[np.ndarray, "k dof"], problem: Problem) -> Bool[np.ndarray, "s"]:
        """Returns which lines of a path keep the margins, and room for their proof, without the other arms."""
        start, end = np.ascontiguousarray(path[:-1]), np.ascontiguousarray(path[1:])
        return core.edges_free(problem.cell.collision.core, arm, start, end, self._levels)

    def keeps_margins(self, arm: int, rows: Float[np.ndarray, "k dof"]) -> bool:
        """Returns whether a motion keeps the margins, and room for the proof of the schedule, without other arms."""
        room, q = KEEP_MARGIN_FACTOR * self._slack, np.ascontiguousarray(rows)
        levels = levels_of(self.problem.margins, room, room)
        return bool(core.edges_free(self.problem.cell.collision.core, arm, q[:-1], q[1:], levels).all())

    def blocked_by(self, arm: int, q: Float[np.ndarray, "dof"], problem: Problem) -> str:
        """Returns words for what an arm is too close to, without the other arms."""
        return what_blocks(problem.cell, problem.cell.arms[arm], q[None], problem.margins)

    def blocking_arms(
        self, arm: int, rows: Float[np.ndarray, "k dof"], others: Sequence[core.Motion], problem: Problem | None = None
    ) -> list[int]:
        """Returns the standing arms that block a path of an arm. `problem`: that of the motions."""
        collision = (self.problem if problem is None else problem).cell.collision
        motions = [collision.motion(self._names[arm], rows), *others]
        pairs = [(0, k) for k in range(1, len(motions))]
        levels = levels_of(self.problem.margins, SEARCH_MARGIN_FACTOR * self._slack, KEEP_MARGIN_FACTOR * self._slack)
        found = collision.conflict_instants(motions, pairs, levels) if pairs else []
        return [motion.arm for motion, instants in zip(others, found, strict=True) if len(instants)]

    def _with_exact_ends(
        self,
        arm: int,
        rows: Float[np.ndarray, "k dof"],
        start: Float[np.ndarray, "dof"],
        goals: Float[np.ndarray, "n dof"],
    ) -> Float[np.ndarray, "k dof"]:
        goal, robot = nearest(goals, rows[-1]), self.problem.cell.arms[arm].robot
        out = np.clip(rows, robot.lower, robot.upper)
        if len(out) == 1 and (start != goal).any():  # so near that the core takes no step for it
            out = np.repeat(out, 2, axis=0)
        out[0], out[-1] = start, goal
        return out
