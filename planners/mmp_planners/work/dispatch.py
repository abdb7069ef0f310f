"""Which arm does what next: jobs by arm, by order in the file, and by what they come after."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from mmp_env.work.jobs import Job, Jobs, Line, Step, Wait
from mmp_env.work.object_steps import Grasp, Release

LOOKAHEAD = 16
"""Largest number of jobs without an arm that are considered at once, the first in the file."""


@dataclass(kw_only=True, eq=False)
class JobState:
    """How far a job is: the number of the arm that does it, the next step, and when it was done [periods]."""

    job: Job
    number: int
    arm: int | None = None
    step: int = 0
    done: int | None = None

    @property
    def next_step(self) -> Step:
        return self.job.steps[self.step]

    @property
    def handles(self) -> bool:
        """Whether the next step grasps or releases an object."""
        return isinstance(self.next_step, Grasp | Release)

    @property
    def left(self) -> tuple[Step, ...]:
        """The steps that are left, from the next one on."""
        return self.job.steps[self.step :]

    @property
    def is_pinned(self) -> bool:
        """Whether the arm must stay where it is between its steps: a line begins there, or it handles an object."""
        ahead = next((step for step in self.left if not isinstance(step, Wait)), None)
        return isinstance(ahead, Line | Grasp | Release)


@dataclass(frozen=True, kw_only=True)
class Option:
    """The next step of an arm, which can begin at `begin` [periods]."""

    begin: int
    arm: int
    state: JobState


class Dispatch:
    """The jobs that are left, and the arms that can go on with them.

    Args:
        jobs: the work.
        finish: returns when an arm would be done with a job that begins no earlier than a period, or infinity for a
            job that it cannot do [periods].
        end: returns when an arm comes to rest [periods].
        may_begin: returns whether an arm may begin a job: it may not if it holds an object and the job grasps another.
    """

    def __init__(
        self,
        jobs: Jobs,
        finish: Callable[[JobState, int, int], float],
        end: Callable[[int], int],
        may_begin: Callable[[JobState, int], bool],
    ) -> None:
        arms = jobs.cell.arm_names
        self._finish, self._end, self._may_begin, self._count = finish, end, may_begin, len(arms)
        self.states = [
            JobState(job=job, number=k, arm=None if job.arm is None else arms.index(job.arm))
            for k, job in enumerate(jobs.jobs)
        ]
        self._by_name = {state.job.name: state for state in self.states}
        self._current: dict[int, JobState] = {}

    def options(self) -> list[Option]:
        """Returns the next step of every arm that has one, the earliest first; none when all jobs are done."""
        asked = 0
        found = [Option(begin=self._end(arm), arm=arm, state=state) for arm, state in self._current.items()]
        taken = set(self._current)
        for state in self.states:
            if state.done is not None or state in self._current.values():
                continue
            ready = self._ready(state)
            if ready is None:
                continue
            if state.arm is None:
                asked += 1
                if asked > LOOKAHEAD:
                    continue
            arm = self._best(state, ready) if state.arm is None else state.arm
            if arm is not None and arm not in taken and self._may_begin(state, arm):
                taken.add(arm)
                found.append(Option(begin=max(ready, self._end(arm)), arm=arm, state=state))
        return sorted(found, key=lambda option: (option.begin, option.state.number))

    @property
    def pinned(self) -> set[int]:
        """Arms in the middle of a job that must stay where they are until their next step."""
        return {arm for arm, state in self._current.items() if state.is_pinned}

    def advance(self, option: Option) -> None:
        """Notes that an arm has done the step of an option; its motion is on the timeline."""
        state = option.state
        state.arm, state.step = option.arm, state.step + 1
        if state.step == len(state.job.steps):
            state.done = self._end(option.arm)
            self._current.pop(option.arm, None)
        else:
            self._current[option.arm] = state

    def _ready(self, state: JobState) -> int | None:
        """Returns when all that a job comes after is done; None if some of it is not planned yet."""
        done = [self._by_name[name].done for name in state.job.after]
        return None if None in done else max((step for step in done if step is not None), default=0)

    @property
    def left(self) -> list[JobState]:
        """The jobs that are not done."""
        return [state for state in self.states if state.done is None]

    def _best(self, state: JobState, ready: int) -> int | None:
        """Returns the arm that would be done first; None if none can begin the job at present."""

        def finish(arm: int) -> float:
            begin, current = float(max(ready, self._end(arm))), self._current.get(arm)
            if current is not None:
                begin = max(ready, self._finish(current, arm, self._end(arm)))
            return self._finish(state, arm, math.ceil(begin)) if math.isfinite(begin) else math.inf

        able = [arm for arm in range(self._count) if arm in self._current or self._may_begin(state, arm)]
        found = {arm: finish(arm) for arm in able}
        return min((arm for arm in able if math.isfinite(found[arm])), key=lambda arm: (found[arm], arm), default=None)
