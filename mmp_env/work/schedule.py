"""A schedule: a trajectory of each arm over all its jobs, on a common clock, and what happens when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.model.margins import Margins
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.model.read_only import ReadOnly
from mmp_env.wording import counted, in_seconds
from mmp_env.work.jobs import Jobs

KINDS_OF_EVENTS = ("move", "wait", "yield")
"""Kinds of events."""
EventKind = Literal["move", "wait", "yield"]
"""Kind of an event: a step of a job, or a motion out of the way of another arm."""
MotionId = tuple[str, int]
"""An arm, and the number of one of its events, from 0."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory(ReadOnly):
    """The motion of one arm from the first job to the last: `positions` [t, dof] [rad] at `times` [t] [s].

    The arm moves straight between two times, and stands still after the last.
    """

    times: Float[np.ndarray, "t"]
    positions: Float[np.ndarray, "t dof"]

    def at(self, times: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
        """Returns the configurations [n, dof] [rad] at `times` [n] [s]."""
        return np.column_stack([np.interp(times, self.times, column) for column in self.positions.T])


@dataclass(frozen=True, kw_only=True)
class WorkEvent:
    """What an arm does from one time to another.

    Attributes:
        begin_s: when it begins [s].
        end_s: when it ends [s].
        arm: the arm.
        kind: `move` and `wait` are steps of a job; an arm yields to let another pass.
        job: the job; None if the arm yields.
        step: number of the step in the job, from 0; None if the arm yields.
    """

    begin_s: float
    end_s: float
    arm: str
    kind: EventKind
    job: str | None = None
    step: int | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Schedule(ReadOnly):
    """The work of all arms. Mappings and arrays are read-only.

    Attributes:
        jobs: the work.
        problem: cell, start, velocity limits and margins; its goal is where the arms stand in the end.
        trajectories: arm name -> its motion.
        events: the events, by begin and then by arm. Outside its events an arm stands still.
        order: pairs of motions that must keep their order.
        proof: clearances [m] that are proved at every instant.
        planner: planner of groups of arms, and seed.
        stats: counts of the run, no wall-clock times.
    """

    jobs: Jobs
    problem: Problem
    trajectories: Mapping[str, Trajectory]
    events: tuple[WorkEvent, ...]
    proof: Margins
    order: tuple[tuple[MotionId, MotionId], ...] = ()
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

    @cached_property
    def arm_of(self) -> Mapping[str, str]:
        """Name of a job -> the arm that does it."""
        return {event.job: event.arm for event in self.events if event.job is not None}

    @cached_property
    def plan(self) -> Plan:
        """The motion of all arms on their common times."""
        times = np.unique(np.concatenate([trajectory.times for trajectory in self.trajectories.values()]))
        return plan_on(self.problem, times, {name: each.at(times) for name, each in self.trajectories.items()})


def plan_on(
    problem: Problem, times: Float[np.ndarray, "t"], positions: Mapping[str, Float[np.ndarray, "t _dof"]]
) -> Plan:
    """Returns a plan whose goal is its own end."""
    end = {name: rows[-1] for name, rows in positions.items()}
    ending = replace(problem, goal=end, goals={}, goal_asked={})
    return Plan(problem=ending, times=times, positions=positions)


def without_rest(times: Float[np.ndarray, "t"], positions: Float[np.ndarray, "t dof"]) -> Trajectory:
    """Returns the trajectory without the samples inside the times at which the arm stands still."""
    moves = (np.diff(positions, axis=0) != 0).any(axis=1)
    keep = np.concatenate([[True], moves]) | np.concatenate([moves, [False]])
    keep[-1] = True
    return Trajectory(times=times[keep], positions=positions[keep])
