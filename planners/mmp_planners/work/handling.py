"""The objects at the end of all committed motions, and what may touch while an arm takes or puts down one of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.problem import Problem
from mmp_env.work.jobs import Job, Wait
from mmp_env.work.object_steps import Grasp, Release
from mmp_env.work.resting import SINK_M
from mmp_env.work.world import (
    Touching,
    World,
    grasp_contacts,
    grip_poses,
    lowest_points,
    support_contacts,
)

NOTHING: Touching = frozenset()
"""No contact is allowed."""
SINK_ROOM_M = 3e-4
"""Room [m] that a path keeps to the lowest place of a held object, for rounded corners."""
DENSE_RAD = 0.02
"""Largest move of a joint between two points of a path at which the height of a held object is tested."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stop:
    """The grasps and releases of an arm between two motions.

    Attributes:
        world: the objects after them.
        before: what may touch in the motion before them.
        after: what may touch in the motion after them.
        step: number of the first step after them.
    """

    world: World
    before: Touching
    after: Touching
    step: int


class Handling:
    """Keeps track of the objects. `problem` is the cell with them, as the next motion that is planned sees it.

    Args:
        problem: cell without objects, start, velocity limits and margins.
        world: the objects at the begin.

    Attributes:
        first: the objects at the begin.
        first_uses: job and object, for the jobs that are the first to use an object.
        world: the objects after all that is committed.
        problem: see above.
    """

    def __init__(self, problem: Problem, world: World, jobs: Sequence[Job]) -> None:
        self.bare, self.first, self.world, self.problem = problem, world, world, problem
        self.first_uses = _first_uses(jobs)
        self._resting: dict[str, Touching] = {}
        self._problems: dict[tuple[World, Touching], Problem] = {}
        self._used: dict[str, int] = {}

    @property
    def touching(self) -> set[int]:
        """Numbers of the arms that touch an object at rest, so that they cannot yield."""
        return {k for k, name in enumerate(self.bare.cell.arm_names) if self._resting.get(name)}

    def look(self, allowed: Mapping[int, Touching] | None = None) -> None:
        """Lets `problem` show the objects after all that is committed.

        Args:
            allowed: arm -> what may touch in the motion that is planned, beside what its rest allows.
        """
        wanted = set().union(*self._resting.values(), *(allowed or {}).values())
        self.problem = self.problem_in(self.world, wanted)

    def look_bare(self) -> None:
        """Lets `problem` show the cell without objects."""
        self.problem = self.bare

    def problem_in(self, world: World, touching: Iterable[tuple[str, str]]) -> Problem:
        """Returns the problem in a world in which some things may touch."""
        if not (world.lying or world.held):
            return self.bare
        allowed = frozenset(touching)
        if (world, allowed) not in self._problems:
            if not any(known is world for known, _ in self._problems):
                self._problems = {key: each for key, each in self._problems.items() if key[0] is self.world}
            self._problems[world, allowed] = replace(self.bare, cell=world.letting(allowed).filled)
        return self._problems[world, allowed]

    def resting(self, arm: Arm) -> Touching:
        """Returns what an arm may touch where it stands, and in the motion from there."""
        return self._resting.get(arm.name, NOTHING)

    def others_resting(self, arm: Arm) -> Touching:
        """Returns what the other arms may touch where they stand."""
        return frozenset().union(*(each for name, each in self._resting.items() if name != arm.name))

    def arrived(self, arm: Arm, touching: Touching) -> None:
        """Notes that an arm has moved, and what it may touch where it stands now."""
        self._resting[arm.name] = touching

    def handled(self, arm: Arm, stop: Stop, names: Iterable[str], end: int) -> None:
        """Notes that an arm has grasped or released an object, until a period; `names` are the objects concerned."""
        self.world = stop.world
        self._resting[arm.name] = self.resting(arm) | stop.after
        self._used |= dict.fromkeys(names, end)

    def used_until(self, names: Iterable[str]) -> int:
        """Returns the period until which some objects are grasped or released."""
        return max((self._used.get(name, 0) for name in names), default=0)

    def held(self, arm: Arm) -> Obstacle | None:
        """Returns what an arm holds in the end."""
        return self.world.held.get(arm.name, arm.held)


def stop_at(world: World, arm: Arm, q: Float[np.ndarray, "dof"], job: Job, first: int, most: int | None = None) -> Stop:
    """Returns what the grasps and releases from a step on do, up to the next motion.

    Args:
        world: the objects before.
        arm: the arm.
        q: where it stands.
        job: the job.
        first: number of the step.
        most: largest number of grasps and releases; None for all.

    Raises:
        InvalidInstanceError: if one of them cannot be done.
    """
    before: set[tuple[str, str]] = set()
    after: set[tuple[str, str]] = set()
    done = 0
    for k in range(first, len(job.steps)):
        step, where = job.steps[k], f"step {k} of job '{job.name}'"
        if isinstance(step, Wait) and done != most:
            continue
        if not isinstance(step, Grasp | Release) or done == most:
            return Stop(world=world, before=frozenset(before), after=frozenset(after), step=k)
        done += 1
        if isinstance(step, Grasp):
            world = world.grasped(arm, step.object, q, where)
            before |= grasp_contacts(arm, step.object)
            after |= support_contacts(arm, world.supports[step.object])
        else:
            world = world.released(arm, step.object, q, where)
            before |= support_contacts(arm, world.supports[step.object])
            after |= grasp_contacts(arm, step.object)
    return Stop(world=world, before=frozenset(before), after=frozenset(after), step=len(job.steps))


def sinks(world: World, arm: Arm, rows: Float[np.ndarray, "k dof"], *, up: bool, down: bool) -> bool:
    """Returns whether a held object goes below where it is at the begin of a path (`up`), or at its end (`down`)."""
    held = world.held.get(arm.name)
    if held is None or not (up or down):
        return False
    heights = lowest_points(held, grip_poses(arm, densely(rows)))
    rests = [heights[0]] * up + [heights[-1]] * down
    return bool(heights.min() < max(rests) - SINK_M + SINK_ROOM_M)


def densely(rows: Float[np.ndarray, "k dof"]) -> Float[np.ndarray, "n dof"]:
    """Returns points of a path between which no joint moves by more than `DENSE_RAD`."""
    counts = np.maximum(np.ceil(np.abs(np.diff(rows, axis=0)).max(axis=1) / DENSE_RAD).astype(int), 1)
    at = np.concatenate([[0.0], *(k + np.arange(1, n + 1) / n for k, n in enumerate(counts))])
    return np.column_stack([np.interp(at, np.arange(len(rows)), column) for column in rows.T])


def first_object_step(job: Job) -> Grasp | Release | None:
    """Returns the first grasp or release of a job, or None."""
    return next((step for step in job.steps if isinstance(step, Grasp | Release)), None)


def _first_uses(jobs: Sequence[Job]) -> frozenset[tuple[str, str]]:
    """Returns job and object, for the jobs that use an object and come after no other job that does."""
    by_name = {job.name: job for job in jobs}
    uses = {job.name: {step.object for step in job.steps if isinstance(step, Grasp | Release)} for job in jobs}
    used_before: dict[str, frozenset[str]] = {}
    waiting = [(job.name, False) for job in reversed(jobs)]
    while waiting:
        name, ready = waiting.pop()
        if ready:
            used_before[name] = frozenset().union(*(used_before[b] | uses[b] for b in by_name[name].after))
        elif name not in used_before:
            waiting += [(name, True), *((before, False) for before in by_name[name].after)]
    return frozenset((name, each) for name, names in uses.items() for each in names - used_before[name])
