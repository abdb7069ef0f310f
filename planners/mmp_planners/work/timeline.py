"""The motions that the arms are bound to, on one grid of periods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.arm import Obstacle
from mmp_env.model.problem import Problem
from mmp_env.work.swept_volumes import SweptMotion, SweptVolumes
from mmp_env.work.trajectory import Trajectory, thinned
from mmp_planners.work.handling import Handling

PLACES_APART_RAD = 0.1
"""Distance of places in a motion that stand for its volume when a path is planned [rad, of slides m]."""

Snapshot = tuple[list[list["Committed"]], list[int], int]
"""Motions, periods at which arms are free, and version."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Committed:
    """A motion of an arm that begins at a period and rests at its end.

    `takes`: the arm stands and takes an object, which lies there until then.
    """

    begin: int
    swept: SweptMotion
    takes: bool = False

    @property
    def end(self) -> int:
        return self.begin + len(self.swept.samples) - 1


class Timeline:
    """The committed motions of each arm. An arm stands at the end of its last motion until it is given another.

    When a motion begins, its whole volume is clear of all that the other arms have not done yet, and the same holds for
    motions that begin later. So delays cause no contact (docs/explanation/schedules.md), and an arm may stay at the end
    of its last motion for good.

    Args:
        handling: the objects, and cell and start.
        distance: clearance between arms [m].
        period_s: length of a period [s].
    """

    def __init__(self, handling: Handling, distance: float, period_s: float) -> None:
        problem = handling.bare
        self._handling, self.period_s, self.names = handling, period_s, problem.cell.arm_names
        self._distance, self._volumes = distance, SweptVolumes(problem.cell)
        starts = [self._volumes.of(arm, np.array(problem.start[name])[None]) for arm, name in enumerate(self.names)]
        self._motions = [[Committed(begin=-1, swept=swept)] for swept in starts]
        self._free = [0] * len(self.names)
        self.version = 0

    @property
    def problem(self) -> Problem:
        """The problem to plan in: cell with objects, velocity limits and margins."""
        return self._handling.problem

    def end(self, arm: int) -> int:
        """Returns the period from which on an arm is free."""
        return self._free[arm]

    def last(self) -> int:
        """Returns the period from which on all arms are free."""
        return max(self._free)

    def rest(self, arm: int) -> Float[np.ndarray, "dof"]:
        """Returns where an arm stands in the end [rad, of slides m]."""
        return self._motions[arm][-1].swept.samples[-1]

    def rests(self, but: Sequence[int], problem: Problem | None = None) -> list[core.Motion]:
        """Returns all arms but some where they stand in the end, for queries in a problem, by default `problem`."""
        collision = (self.problem if problem is None else problem).cell.collision
        return [collision.motion(name, self.rest(arm)[None]) for arm, name in enumerate(self.names) if arm not in but]

    def volumes(self, but: Sequence[int], problem: Problem | None = None) -> list[core.Motion]:
        """Returns all that arms but some have still to do when the first of these is free, as arms that stand still.

        They stand at points of their motions, close to each other.
        """
        collision = (self.problem if problem is None else problem).cell.collision
        since = min(self.end(arm) for arm in but)
        out = []
        for arm, name in enumerate(self.names):
            if arm not in but:
                rows = [
                    motion.swept.samples[max(since - motion.begin, 0) :]
                    for motion in self._motions[arm]
                    if motion.end > since
                ]
                places = _apart(np.concatenate([*rows, self.rest(arm)[None]]), PLACES_APART_RAD)
                out += [collision.motion(name, q[None]) for q in places]
        return out

    def earliest(self, arm: int, samples: Float[np.ndarray, "k dof"]) -> int | None:
        """Returns the first period at which a motion of an arm may begin; None if an arm at rest blocks it."""
        return self._earliest(arm, self._volumes.of(arm, samples, self._held(arm)))

    def _earliest(self, arm: int, swept: SweptMotion) -> int | None:
        begin = self.end(arm)
        others = [motions for other, motions in enumerate(self._motions) if other != arm]
        known: dict[Committed, tuple[int, int]] = {}
        while True:
            later = [self._begin_after(begin, swept, motions, known) for motions in others]
            if None in later:
                return None
            latest = max((period for period in later if period is not None), default=begin)
            if latest == begin:
                return begin
            begin = latest

    def append(self, arm: int, begin: int, samples: Float[np.ndarray, "k dof"]) -> None:
        """Lets an arm move through samples, one per period. The first two and the last two are equal."""
        swept = self._volumes.of(arm, samples, self._held(arm))
        self._motions[arm].append(Committed(begin=begin, swept=swept))
        self._free[arm] = self._motions[arm][-1].end
        self.version += 1

    def hand(self, arm: int, held: Obstacle | None) -> int | None:
        """Lets an arm take an object, or put one down (None), where it stands, and gives it a period to do so.

        Returns:
            The period at which it does so; None if an arm at rest blocks it.
        """
        swept = self._volumes.of(arm, self.rest(arm)[None], held)
        begin = self._earliest(arm, swept)
        if begin is not None:
            self._motions[arm].append(Committed(begin=begin, swept=swept, takes=held is not None))
            self._free[arm] = self._motions[arm][-1].end
            self.version += 1
        return begin

    def _held(self, arm: int) -> Obstacle | None:
        return self._handling.world.held.get(self.names[arm])

    def wait(self, arm: int, until: int) -> None:
        """Lets an arm stand until a period, if that is later than its end."""
        self._free[arm] = max(self._free[arm], until)

    def append_together(self, samples: Mapping[str, Float[np.ndarray, "k _dof"]]) -> int:
        """Lets all arms move from the period at which the last of them is at rest. Returns that period."""
        begin = self.last()
        for arm, name in enumerate(self.names):
            self.append(arm, begin, samples[name])
        return begin

    def snapshot(self) -> Snapshot:
        """Returns the state of the timeline, for `restore`."""
        return [list(motions) for motions in self._motions], list(self._free), self.version

    def restore(self, snapshot: Snapshot) -> None:
        """Takes back all that was committed after a snapshot."""
        motions, free, self.version = snapshot
        self._motions, self._free = [list(each) for each in motions], list(free)

    def trajectories(self) -> dict[str, Trajectory]:
        """Returns arm name -> its motion from the first to the last."""
        return {
            name: self._trajectory(motions, free)
            for name, motions, free in zip(self.names, self._motions, self._free, strict=True)
        }

    def _trajectory(self, motions: Sequence[Committed], free: int) -> Trajectory:
        rows = np.repeat(motions[0].swept.samples[:1], free + 1, axis=0)
        for motion in motions[1:]:
            rows[motion.begin : motion.end + 1] = motion.swept.samples
            rows[motion.end + 1 :] = motion.swept.samples[-1]
        return thinned(rows, self.period_s)

    def _begin_after(
        self, begin: int, swept: SweptMotion, motions: Sequence[Committed], known: dict[Committed, tuple[int, int]]
    ) -> int | None:
        """Returns the period from which on another arm lets a motion begin, as far as one look tells."""
        present = max(k for k, motion in enumerate(motions) if motion.begin <= begin)
        for k, motion in enumerate(motions[present:], present):
            if motion not in known:
                known[motion] = self._volumes.last_conflicts(motion.swept, swept, self._distance)
            theirs, own = known[motion]
            following = motions[k + 1].begin if k + 1 < len(motions) else None
            # The last period of a motion is its rest, which lasts.
            if k > present and own >= 0 and (own == swept.last or begin + own + 1 > motion.begin or motion.takes):
                return motion.begin
            if k == present and theirs >= 0:
                past = following if theirs == motion.swept.last else motion.begin + theirs + 1
                if past is None or past > begin:
                    return past
        return begin


def _apart(rows: Float[np.ndarray, "k dof"], distance: float) -> Float[np.ndarray, "m dof"]:
    """Returns rows of a motion, each about a distance from the one before [rad, of slides m], and the last one."""
    moved = np.concatenate([[0.0], np.abs(np.diff(rows, axis=0)).max(axis=1).cumsum()])
    chosen = np.unique(np.searchsorted(moved, np.arange(0.0, moved[-1], distance)))
    return rows[np.append(chosen, len(rows) - 1)]
