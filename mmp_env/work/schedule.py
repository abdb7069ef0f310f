"""A schedule: a trajectory of each arm over all its jobs, on a common clock, and what happens when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.model.arm import Obstacle
from mmp_env.model.margins import Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.model.read_only import ReadOnly
from mmp_env.wording import counted, in_seconds
from mmp_env.work.jobs import Jobs
from mmp_env.work.lower_bound import makespan_lower_bound
from mmp_env.work.trajectory import Trajectory

KINDS_OF_EVENTS = ("move", "line", "grasp", "release", "wait", "yield")
"""Kinds of events."""
EventKind = Literal["move", "line", "grasp", "release", "wait", "yield"]
"""Kind of an event: a step of a job, or a yield, a motion that clears the path of another arm."""
MotionId = tuple[str, int]
"""An arm, and the number of one of its events, from 0."""


@dataclass(frozen=True, kw_only=True)
class WorkEvent:
    """A motion, a pause or a handling of an object by one arm, from one time to another.

    Attributes:
        begin_s: when it begins [s].
        end_s: when it ends [s].
        arm: the arm.
        kind: an arm yields to let another pass; all other kinds are steps of a job.
        job: the job; None if the arm yields.
        step: number of the step in the job, from 0; None if the arm yields.
        group: number of the group, if several arms were planned together; they begin at once, on one clock.
        solid: the object that is grasped or released, where it is then; otherwise None.
    """

    begin_s: float
    end_s: float
    arm: str
    kind: EventKind
    job: str | None = None
    step: int | None = None
    group: int | None = None
    solid: Obstacle | None = None


@dataclass(frozen=True, kw_only=True)
class OrderPair:
    """Two motions that keep their order: the second begins when the first is past a point, or later.

    Attributes:
        first: the motion that is ahead.
        second: the motion of another arm that waits.
        past_s: time since the begin of the first motion [s] that it must be past.
    """

    first: MotionId
    second: MotionId
    past_s: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Schedule(ReadOnly):
    """The work of all arms. Mappings and arrays are read-only.

    Attributes:
        jobs: the work.
        problem: cell, start, velocity limits and margins; its goal is where the arms stand in the end.
        max_acceleration: arm name -> [dof] [rad/s^2], limits of the motions.
        max_jerk: arm name -> [dof] [rad/s^3], limits of the motions.
        trajectories: arm name -> its motion.
        events: the events, by begin and then by arm. Outside its events an arm stands still.
        order: pairs of motions that must keep their order.
        proof: clearances [m] that are proved at every instant.
        planner: planner of groups of arms, and seed.
        stats: counts of the run, no wall-clock times.
    """

    jobs: Jobs
    problem: Problem
    max_acceleration: Mapping[str, Float[np.ndarray, "dof"]]
    max_jerk: Mapping[str, Float[np.ndarray, "dof"]]
    trajectories: Mapping[str, Trajectory]
    events: tuple[WorkEvent, ...]
    proof: Margins
    order: tuple[OrderPair, ...] = ()
    planner: Mapping[str, Any] = field(default_factory=dict)
    stats: Mapping[str, Any] = field(default_factory=dict)

    @brief
    def __repr__(self) -> str:
        jobs, arms = counted(len(self.jobs.jobs), "job"), counted(len(self.trajectories), "arm")
        return f"{self.jobs.name}: {jobs} by {arms} in {in_seconds(self.makespan_s)}"

    @property
    def makespan_s(self) -> float:
        """Time when the last job is done [s]."""
        return max(float(trajectory.times[-1]) for trajectory in self.trajectories.values())

    @property
    def busiest_s(self) -> float:
        """Time of the steps of the busiest arm [s]: a lower bound of the makespan with these motions and arms."""
        return max(self._busy_s().values(), default=0.0)

    @property
    def balanced_s(self) -> float:
        """Time of all steps divided by the number of arms [s]: a lower bound with these motions and any arms."""
        return sum(self._busy_s().values()) / len(self.trajectories)

    @cached_property
    def lower_bound_s(self) -> float:
        """A time that every schedule of these jobs takes at least [s], see `makespan_lower_bound`."""
        return makespan_lower_bound(self.jobs, self.problem.max_velocity)

    def _busy_s(self) -> dict[str, float]:
        steps = [event for event in self.events if event.job is not None]
        return {arm: sum(e.end_s - e.begin_s for e in steps if e.arm == arm) for arm in self.trajectories}

    @cached_property
    def arm_of(self) -> Mapping[str, str]:
        """Name of a job -> the arm that does it."""
        return {event.job: event.arm for event in self.events if event.job is not None}

    @cached_property
    def assigned(self) -> Jobs:
        """The jobs with the arms that do them, in the order in which they begin."""
        names = list(dict.fromkeys(event.job for event in self.events if event.job is not None))
        by_name = {job.name: job for job in self.jobs.jobs}
        jobs = tuple(replace(by_name[name], arm=self.arm_of[name]) for name in names)
        return replace(self.jobs, jobs=jobs)

    @cached_property
    def plan(self) -> Plan:
        """The motion of all arms, straight between times so close that the curves stray by `STRAY_RAD` at most."""
        return plan_of(self.problem, self.trajectories)


def plan_of(problem: Problem, trajectories: Mapping[str, Trajectory]) -> Plan:
    """Returns the motion of all arms as a plan that ends where it ends, without times at which no arm moves."""
    period_s = next(iter(trajectories.values())).period_s
    steps = max(len(each.samples) for each in trajectories.values()) - 1
    parts = np.zeros(steps, dtype=int)
    for each in trajectories.values():
        parts[: len(each.samples) - 1] = np.maximum(parts[: len(each.samples) - 1], each.parts())
    begins = np.repeat(np.arange(steps), parts)
    nth = np.arange(len(begins)) - np.repeat(np.cumsum(parts) - parts, parts)
    times = period_s * np.append(begins + nth / np.repeat(parts, parts), steps)
    rows = {name: each.at(times) for name, each in trajectories.items()}
    moves = np.any([(np.diff(each, axis=0) != 0).any(axis=1) for each in rows.values()], axis=0)
    kept = np.concatenate([[True], moves]) | np.concatenate([moves, [True]])
    rows = {name: each[kept] for name, each in rows.items()}
    end = {name: each[-1] for name, each in rows.items()}
    ending = replace(problem, goal=end, goals={}, goal_asked={})
    return Plan(problem=ending, times=times[kept], positions=rows)


def numbered(events: Sequence[WorkEvent]) -> dict[MotionId, WorkEvent]:
    """Returns the events by arm and number, those of an arm in their order."""
    out: dict[MotionId, WorkEvent] = {}
    counts: dict[str, int] = {}
    for event in sorted(events, key=lambda event: (event.begin_s, event.end_s)):
        counts[event.arm] = counts.get(event.arm, -1) + 1
        out[event.arm, counts[event.arm]] = event
    return out
