"""Moves arms aside that block the path of another arm."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_planners.work.commitment import Commitment
from mmp_planners.work.move_planner import MovePlanner
from mmp_planners.work.timeline import Timeline

RANDOM_PLACES = 200
"""Number of random configurations among the places that an arm may yield to."""
TRIED_PLACES = 16
"""Largest number of places that the single-arm planner gets."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Aside:
    """A motion of an arm off the path of another arm: periods at which it begins and ends."""

    arm: int
    begin: int
    end: int


class Yielding:
    """Finds places aside, and commits motions to them.

    Args:
        mover: plans single arms.
        timeline: the committed motions.
        commitment: commits motions.
        seed: seed of the random places.
    """

    def __init__(self, mover: MovePlanner, timeline: Timeline, commitment: Commitment, seed: int) -> None:
        self._mover, self._timeline, self._commitment = mover, timeline, commitment
        self._rng = np.random.default_rng(seed)

    def clear_path(self, arm: int, path: Float[np.ndarray, "k dof"], may_yield: Collection[int]) -> list[Aside]:
        """Moves the arms aside that block the path of an arm.

        Args:
            arm: number of the arm that wants to move.
            path: the path that it wants to take, clear of all arms that may not yield.
            may_yield: arms that may be asked.

        Returns:
            The motions, which are committed; none if an arm that blocks the path cannot yield.
        """
        timeline, collision = self._timeline, self._mover.problem.cell.collision
        standing = [collision.motion(timeline.names[b], timeline.rest(b)[None]) for b in may_yield if b != arm]
        moved, before = [], timeline.snapshot()
        for other in self._mover.blocking_arms(arm, path, standing):
            aside = self._move_aside(other, arm, path)
            if aside is None:
                timeline.restore(before)
                return []
            moved.append(aside)
        return moved

    def places(self, arm: int, count: int) -> Float[np.ndarray, "m dof"]:
        """Returns configurations that are free alone, the nearest to where the arm stands first."""
        problem, here = self._mover.problem, self._timeline.rest(arm)
        of, name = problem.cell.arms[arm], problem.cell.arms[arm].name
        lower, upper = np.maximum(of.robot.lower, here - np.pi), np.minimum(of.robot.upper, here + np.pi)
        random = self._rng.uniform(lower, upper, (count, of.dof))
        rows = np.concatenate([[of.robot.home, of.robot.tucked, problem.start[name]], random])
        rows = rows[np.abs(rows - here).max(axis=1).argsort(kind="stable")]
        return self._mover.free_alone(arm, rows)

    def _move_aside(self, other: int, arm: int, path: Float[np.ndarray, "k dof"]) -> Aside | None:
        """Moves an arm to the nearest places that the path of another leaves free."""
        timeline = self._timeline
        clear = self._clear(other, arm, path)
        if not len(clear):
            return None
        rows = self._mover.plan(other, timeline.rest(other), clear, timeline.rests([other]))
        motion = None if rows is None else self._commitment.propose(other, rows)
        if motion is None:
            return None
        self._commitment.commit(motion)
        return Aside(arm=other, begin=motion.begin, end=timeline.end(other))

    def _clear(self, other: int, arm: int, path: Float[np.ndarray, "k dof"]) -> Float[np.ndarray, "m dof"]:
        """Returns places of an arm that a path of another leaves free."""
        cell, name = self._mover.problem.cell, self._timeline.names[other]
        collision, of = cell.collision, cell.arms[other]
        out: list[Float[np.ndarray, "dof"]] = []
        for q in self.places(other, RANDOM_PLACES):
            if len(out) == TRIED_PLACES:
                break
            if not self._mover.blocking_arms(arm, path, [collision.motion(name, q[None])]):
                out.append(q)
        return np.array(out).reshape(len(out), of.dof)
