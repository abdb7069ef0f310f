"""Jobs: steps that one arm does in their order, and what each job has to wait for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, number, refused, text
from mmp_env.brief import brief
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell, given_cell
from mmp_env.model.goals import AnyOf, Goal, NamedGoal, Stay, goal_to_data
from mmp_env.model.names import NAMES, is_name
from mmp_env.model.read_only import ReadOnly
from mmp_env.wording import counted, shown
from mmp_env.work.object_steps import Grasp, Release, check_objects

MOST_JOBS = 10_000
"""Largest number of jobs."""
LONGEST_WAIT_S = 3600.0
"""Longest wait of a step [s]."""
SHORTEST_LINE_M, LONGEST_LINE_M = 1e-4, 10.0
"""Bounds of the length of a line [m]."""
LINE_TOLERANCE = 1e-3
"""Largest distance of a tool from its line [m], and of its rotation from that at the begin [rad]."""


@dataclass(frozen=True)
class Move:
    """A step that moves an arm to a goal. The planner chooses the path. `stay` is where the arm is then."""

    goal: Goal

    def __post_init__(self) -> None:
        if not isinstance(self.goal, Goal):
            raise refused("the goal of a move", self.goal, "a goal, such as NamedGoal('tucked') or a PoseGoal")


@dataclass(frozen=True)
class Wait:
    """A step in which an arm stands still for some time [s]."""

    seconds: float

    def __post_init__(self) -> None:
        allowed = f"a number of seconds above 0, {LONGEST_WAIT_S:g} at most"
        if number("the time of a wait", self.seconds, allowed) > LONGEST_WAIT_S:
            raise MmpError(f"a wait takes {self.seconds:g} s; it must be {allowed}")


@dataclass(frozen=True, init=False)
class Line:
    """A step that moves the tool straight, and does not turn it.

    Attributes:
        by: displacement of the tool in the world [3] [m].
    """

    by: tuple[float, ...]

    def __init__(self, by: ArrayLike) -> None:
        numbers = as_numbers(by)
        if numbers is None or numbers.shape != (3,) or not np.isfinite(numbers).all():
            raise refused("the displacement of a line", by, "3 finite numbers [m]")
        length = float(np.linalg.norm(numbers))
        if not SHORTEST_LINE_M <= length <= LONGEST_LINE_M:
            raise MmpError(
                f"a line is {length:g} m long; it must be from {SHORTEST_LINE_M:g} to {LONGEST_LINE_M:g} m long"
            )
        object.__setattr__(self, "by", tuple(numbers.tolist()))


Step: TypeAlias = Move | Line | Wait | Grasp | Release
"""One step of a job."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """Steps that one arm does, one after another.

    Attributes:
        name: name of the job.
        steps: at least one.
        arm: arm that does the job; None lets the scheduler choose.
        after: names of the jobs that are done before this one begins.
    """

    name: str
    steps: tuple[Step, ...]
    arm: str | None = None
    after: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not is_name(text("name of a job", self.name)):
            raise MmpError(f"a job is named {shown(self.name)}; a name must be {NAMES}")
        object.__setattr__(self, "steps", tuple(self.steps))
        if isinstance(self.after, str):
            raise refused(f"after of job '{self.name}'", self.after, "names of jobs in a tuple or list")
        object.__setattr__(self, "after", tuple(dict.fromkeys(self.after)))
        if not self.steps:
            raise MmpError(f"job '{self.name}' has no steps; it needs at least one")
        for step in self.steps:
            if not isinstance(step, Move | Line | Wait | Grasp | Release):
                raise refused(f"a step of job '{self.name}'", step, "a Move, Line, Wait, Grasp or Release")


@dataclass(frozen=True, kw_only=True, eq=False)
class Jobs(ReadOnly):
    """The work of a cell.

    Attributes:
        name: name of the work.
        cell: arms and obstacles.
        jobs: at least one.
        start: arm name -> where the arm stands at first; by default every arm is `tucked`.
        objects: what the arms can grasp, where it lies at first.

    Raises:
        MmpError: for unknown arms, jobs and objects, repeated names, jobs that wait for each other, and objects that
            are not grasped and released in turn.
    """

    name: str
    cell: Cell
    jobs: tuple[Job, ...]
    start: Mapping[str, Goal] = field(default_factory=dict)
    objects: tuple[Obstacle, ...] = ()

    def __post_init__(self) -> None:
        names = given_cell(self.cell).arm_names
        object.__setattr__(self, "jobs", tuple(self.jobs))
        object.__setattr__(self, "objects", tuple(self.objects))
        for arm in self.start:
            if arm not in names:
                raise MmpError(f"start: {UnknownNameError('arm', arm, names)}")
        home = {arm: self.start.get(arm, NamedGoal("tucked")) for arm in names}
        for arm, goal in home.items():
            if isinstance(goal, Stay | AnyOf):
                raise MmpError(
                    f"start of arm '{arm}' must be one configuration or pose; 'stay' and 'any' are for goals"
                )
        object.__setattr__(self, "start", home)
        _check(self.jobs, names)
        check_objects(self.cell, self.objects, self.jobs)
        super().__post_init__()

    @brief
    def __repr__(self) -> str:
        steps = sum(len(job.steps) for job in self.jobs)
        return f"{self.name}: {counted(len(self.jobs), 'job')} of {counted(steps, 'step')} in cell {self.cell.name}"


def step_to_data(step: Step) -> dict[str, Any]:
    """Returns the form of JSON of a step."""
    if isinstance(step, Move):
        return {"move": goal_to_data(step.goal)}
    if isinstance(step, Grasp | Release):
        return {"grasp" if isinstance(step, Grasp) else "release": step.object}
    return {"line": list(step.by)} if isinstance(step, Line) else {"wait": step.seconds}


def job_to_data(job: Job) -> dict[str, Any]:
    """Returns the form of JSON of a job."""
    arm = {} if job.arm is None else {"arm": job.arm}
    after = {"after": list(job.after)} if job.after else {}
    return {"name": job.name, **arm, "steps": [step_to_data(step) for step in job.steps], **after}


def _check(jobs: Sequence[Job], arms: Sequence[str]) -> None:
    """Raises `MmpError` unless the jobs fit together."""
    if not 1 <= len(jobs) <= MOST_JOBS:
        raise MmpError(f"the work has {counted(len(jobs), 'job')}; it needs at least one, and {MOST_JOBS} at most")
    twice = [name for name, count in Counter(job.name for job in jobs).items() if count > 1]
    if twice:
        raise MmpError(f"two jobs are named '{twice[0]}'; names must differ")
    names = [job.name for job in jobs]
    for job in jobs:
        if job.arm is not None and job.arm not in arms:
            raise MmpError(f"job '{job.name}': {UnknownNameError('arm', job.arm, arms)}")
        for before in job.after:
            if before not in names:
                raise MmpError(f"after of job '{job.name}': {UnknownNameError('job', before, names)}")
    if cycle := _cycle({job.name: job.after for job in jobs}):
        raise MmpError(f"these jobs wait for each other, so that none can begin: {' after '.join(cycle)}")


def _cycle(after: Mapping[str, Sequence[str]]) -> list[str]:
    """Returns names of jobs of which each waits for the next, the first again at the end; empty without a cycle."""
    left = dict(after)
    while free := [name for name, before in left.items() if not any(other in left for other in before)]:
        for name in free:
            del left[name]
    if not left:
        return []
    seen = [next(iter(left))]
    while True:
        following = next(other for other in left[seen[-1]] if other in left)
        if following in seen:
            return [*seen[seen.index(following) :], following]
        seen.append(following)
