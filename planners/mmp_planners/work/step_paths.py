"""Paths of the steps of jobs. A move is chosen so that the lines, grasps and releases after it are possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.errors import InvalidInstanceError
from mmp_env.model.arm import Arm
from mmp_env.model.goals import Stay
from mmp_env.model.problem import Problem
from mmp_env.problems.straight_line import along_line
from mmp_env.work.jobs import Job, Line, Move
from mmp_env.work.object_steps import Grasp
from mmp_env.work.world import Touching, World
from mmp_planners.work.handling import Handling, Stop, sinks, stop_at
from mmp_planners.work.move_planner import MovePlanner

LINE_PATH_TOLERANCE = 2e-4
"""Largest distance of a tool from its line on the path of a line [m], and of its rotation [rad]."""
MOST_ENDS = 4
"""Largest number of ends of a move that a search gets, if other steps follow."""
FEW_ENDS = 2
"""The same number for the first search for a path."""
MOST_TRIED = 24
"""Largest number of ends of a move, the nearest ones, from which the steps after it are tried."""


@runtime_checkable
class Others(Protocol):
    """Returns other arms as motions that stand still, for queries in a problem, by default the one to plan in."""

    def __call__(self, problem: Problem | None = None) -> list[core.Motion]: ...


@dataclass(frozen=True, kw_only=True, eq=False)
class LinePath:
    """The path of a line [k, dof], the problem that it is free in, and the stop at its end."""

    path: Float[np.ndarray, "k dof"]
    problem: Problem
    stop: Stop


@dataclass(frozen=True, kw_only=True, eq=False)
class End:
    """A configuration at which a move may end, the stop there, and the lines up to the next move."""

    q: Float[np.ndarray, "dof"]
    stop: Stop
    lines: tuple[LinePath, ...] = ()


class StepPaths:
    """Finds ends and paths of steps.

    Args:
        mover: plans moves.
        handling: the objects.
    """

    def __init__(self, mover: MovePlanner, handling: Handling) -> None:
        self._mover, self._handling = mover, handling
        self._ends: dict[tuple[World, Touching, int, str, int, int, bytes], list[End] | InvalidInstanceError] = {}
        self._kinematic: dict[tuple[int, Line, bytes], Float[np.ndarray, "k dof"] | str] = {}

    def ends(self, arm: int, job: Job, step: int, near: Float[np.ndarray, "dof"], most: int = MOST_ENDS) -> list[End]:
        """Returns where a move may end, the nearest first: free alone, and so are the lines up to the next move.

        Args:
            arm: number of the arm.
            job: the job.
            step: number of the move.
            near: where the arm stands [rad, of slides m].
            most: largest number of ends if other steps follow.

        Raises:
            InvalidInstanceError: if there are none.
        """
        of = self._mover.problem.cell.arms[arm]
        state = self._handling.world, self._handling.resting(of) | self._handling.others_resting(of)
        if self._ends and next(iter(self._ends))[0] is not state[0]:
            self._ends.clear()
        key = *state, arm, job.name, step, most, np.asarray(near, dtype=float).tobytes()
        if key not in self._ends:
            try:
                self._ends[key] = self._found_ends(arm, job, step, near, most)
            except InvalidInstanceError as error:
                self._ends[key] = error
        found = self._ends[key]
        if isinstance(found, InvalidInstanceError):
            raise found
        return found

    def _found_ends(self, arm: int, job: Job, step: int, near: Float[np.ndarray, "dof"], most: int) -> list[End]:
        move, where = job.steps[step], where_of(job, step)
        assert isinstance(move, Move)
        of, world = self._mover.problem.cell.arms[arm], self._handling.world
        rows = self._mover.configurations(arm, move.goal, near, where)
        tail = step + 1 < len(job.steps) and not isinstance(job.steps[step + 1], Move)
        if not tail or isinstance(move.goal, Stay):
            free = self._mover.free_of(arm, rows, move.goal, where)
            return [End(q=q, stop=stop_at(world, of, q, job, step + 1)) for q in free]
        out: list[End] = []
        reason: InvalidInstanceError | None = None
        for q in rows[:MOST_TRIED]:
            try:
                stop = stop_at(world, of, q, job, step + 1)
                self._allow(arm, stop.before)
                self._mover.free_of(arm, q[None], move.goal, where)
                out.append(End(q=q, stop=stop, lines=self.lines(arm, q, job, stop)))
            except InvalidInstanceError as error:
                reason = reason or error
            if len(out) == most:
                break
        if not out:
            assert reason is not None
            more = "; no other end of the move allows the steps after it either" if len(rows) > 1 else ""
            raise InvalidInstanceError(f"{reason}{more}")
        return out

    def ends_alone(self, arm: int, job: Job, step: int, near: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "n dof"]:
        """Returns where a move may end in the cell without objects; the nearest alone if other steps follow.

        The lines after it are free, and the tool comes to an object that nobody has moved before it is grasped.

        Raises:
            InvalidInstanceError: if there are none.
        """
        move, where = job.steps[step], where_of(job, step)
        assert isinstance(move, Move)
        goals = self._mover.goals(arm, move.goal, near, where)
        tail = step + 1 < len(job.steps) and not isinstance(job.steps[step + 1], Move)
        if not tail or isinstance(move.goal, Stay):
            return goals
        reason: InvalidInstanceError | None = None
        for q in goals[:MOST_TRIED]:
            try:
                self._follow_alone(arm, q, job, step + 1)
                return q[None]
            except InvalidInstanceError as error:
                reason = reason or error
        more = "; no other end of the move allows the steps after it either" if len(goals) > 1 else ""
        raise InvalidInstanceError(f"{reason}{more}")

    def _follow_alone(self, arm: int, q: Float[np.ndarray, "dof"], job: Job, first: int) -> None:
        """Raises `InvalidInstanceError` if the steps up to the next move are impossible in the cell without objects."""
        of = self._mover.problem.cell.arms[arm]
        for k, step in enumerate(job.steps[first:], first):
            where = where_of(job, k)
            if isinstance(step, Move):
                return
            if isinstance(step, Line):
                path = self._along(of, arm, q, step, where)
                self._refuse_blocked(arm, path, self._mover.problem, where)
                q = path[-1]
            elif isinstance(step, Grasp) and (job.name, step.object) in self._handling.first_uses:
                self._handling.first.refuse_far(of, step.object, q, where)

    def lines(self, arm: int, q: Float[np.ndarray, "dof"], job: Job, stop: Stop) -> tuple[LinePath, ...]:
        """Returns the lines from a stop to the next move, free alone. Raises `InvalidInstanceError` if one is not."""
        out = []
        while stop.step < len(job.steps) and isinstance(job.steps[stop.step], Line):
            out.append(self.line(arm, q, job, stop.step, stop.world, stop.after))
            q, stop = out[-1].path[-1], out[-1].stop
        return tuple(out)

    def line(
        self, arm: int, q: Float[np.ndarray, "dof"], job: Job, step: int, world: World, touching: Touching
    ) -> LinePath:
        """Returns the path of a line, free alone, and the stop after it.

        Args:
            arm: number of the arm.
            q: where it begins [dof].
            job: the job.
            step: number of the line.
            world: the objects at its begin.
            touching: what may touch there.

        Raises:
            InvalidInstanceError: if the arm cannot follow the line, a body blocks it, or the stop is impossible.
        """
        line, where, of = job.steps[step], where_of(job, step), self._mover.problem.cell.arms[arm]
        assert isinstance(line, Line)
        path = self._along(of, arm, q, line, where)
        stop = stop_at(world, of, path[-1], job, step + 1)
        allowed = touching | stop.before
        problem = self._handling.problem_in(world, allowed | self._handling.others_resting(of))
        self._refuse_blocked(arm, path, problem, where)
        refuse_sinking(world, of, path, touching, stop, where)
        return LinePath(path=path, problem=problem, stop=stop)

    def _refuse_blocked(self, arm: int, path: Float[np.ndarray, "k dof"], problem: Problem, where: str) -> None:
        free, name = self._mover.edges_free(arm, path, problem), problem.cell.arm_names[arm]
        if not free.all():
            at = int(np.flatnonzero(~free)[0]) + 1
            words = self._mover.blocked_by(arm, path[at], problem)
            raise InvalidInstanceError(
                f"{where}: the line of arm '{name}' is not free: after {at / (len(path) - 1):.0%} of it, {words}"
            )

    def _allow(self, arm: int, touching: Touching) -> None:
        self._handling.look({arm: touching})

    def _along(self, of: Arm, arm: int, q: Float[np.ndarray, "dof"], line: Line, where: str) -> np.ndarray:
        """Returns the path along a line. Raises `InvalidInstanceError` if the arm cannot follow it."""
        key = arm, line, np.asarray(q, dtype=float).tobytes()
        if key not in self._kinematic:
            try:
                path = along_line(of, q, np.array(line.by), LINE_PATH_TOLERANCE).q
                self._kinematic[key] = path
                back = Line([-each for each in line.by])
                self._kinematic.setdefault((arm, back, path[-1].tobytes()), path[::-1])
            except InvalidInstanceError as error:
                self._kinematic[key] = str(error)
        found = self._kinematic[key]
        if isinstance(found, str):
            raise InvalidInstanceError(f"{where}: {found}")
        return found

    def clear_of(self, arm: int, ends: Sequence[End], others: Others) -> list[End]:
        """Returns the ends of a move from which the lines after it are clear of other arms."""
        return [end for end in ends if all(self.is_clear(arm, line, others) for line in end.lines)]

    def is_clear(self, arm: int, line: LinePath, others: Others) -> bool:
        """Returns whether a line is clear of other arms."""
        return not self._mover.blocking_arms(arm, line.path, others(line.problem), line.problem)


def refuse_sinking(
    world: World, arm: Arm, path: Float[np.ndarray, "k dof"], touching: Touching, stop: Stop, where: str
) -> None:
    """Raises `InvalidInstanceError` if a held object goes below where it was taken from, or where it is put down."""
    held = f"{arm.name}/held"
    up, down = (any(part == held for part, _ in each) for each in (touching, stop.before))
    if sinks(world, arm, path, up=up, down=down):
        raise InvalidInstanceError(
            f"{where}: '{world.held[arm.name].name}' would go below where it {'was' if up else 'is put'}"
        )


def where_of(job: Job, step: int) -> str:
    """Returns the begin of messages about a step."""
    return f"step {step} of job '{job.name}'"
