"""Estimates of when an arm would be done with a job, and which jobs no arm can do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from mmp_env.errors import InvalidInstanceError
from mmp_env.work.jobs import Line, Move, Step, Wait
from mmp_planners.work.dispatch import JobState
from mmp_planners.work.handling import Handling
from mmp_planners.work.move_planner import MovePlanner
from mmp_planners.work.step_paths import StepPaths
from mmp_planners.work.timeline import Timeline

LINE_SPEED = 0.3
"""Speed of a line for estimates of who is done first [m/s]."""


class Estimates:
    """Knows about how long jobs take each arm, from the goals of their moves in the cell without objects.

    Args:
        mover: plans single arms.
        handling: the objects.
        paths: finds goals.
        timeline: the committed motions.
    """

    def __init__(self, mover: MovePlanner, handling: Handling, paths: StepPaths, timeline: Timeline) -> None:
        self._mover, self._handling, self._paths, self._timeline = mover, handling, paths, timeline
        self._known: dict[tuple[int, int, int], Float[np.ndarray, "n dof"] | None] = {}
        self._durations: dict[tuple[int, int, int, bytes], float] = {}

    def _goals(self, state: JobState, step: int, arm: int) -> Float[np.ndarray, "n dof"] | None:
        """Returns the goals of a step as seen from the start; None if the arm has none."""
        key = state.number, step, arm
        if key not in self._known:
            try:
                self._known[key] = self._first_goals(state, step, arm)
            except InvalidInstanceError:
                self._known[key] = None
        return self._known[key]

    def _first_goals(self, state: JobState, step: int, arm: int) -> Float[np.ndarray, "n dof"]:
        self._handling.look_bare()
        start = self._mover.problem.start[self._timeline.names[arm]]
        return self._paths.ends_alone(arm, state.job, step, start)

    def finish(self, state: JobState, arm: int, begin: int) -> float:
        """Returns about when an arm would be done with a job; infinity if it cannot do it [periods]."""
        at = self._timeline.rest(arm)
        key = state.number, state.step, arm, at.tobytes()
        if key not in self._durations:
            self._durations[key] = self._estimate(state, arm, at) / self._timeline.period_s
        return begin + self._durations[key]

    def _estimate(self, state: JobState, arm: int, at: Float[np.ndarray, "dof"]) -> float:
        """Returns about how long the rest of a job takes an arm [s]; infinity if it cannot do it."""
        speed, total = self._mover.problem.max_velocity[self._timeline.names[arm]], 0.0
        for k, step in list(enumerate(state.job.steps))[state.step :]:
            if not isinstance(step, Move):
                total += self._lasting(step)
                continue
            rows = self._goals(state, k, arm)
            if rows is None:
                return math.inf
            durations = (np.abs(rows - at) / speed).max(axis=1)
            total, at = total + float(durations.min()), rows[int(durations.argmin())]
        return total

    def _lasting(self, step: Step) -> float:
        """Returns about how long a step takes that is no move [s]."""
        if isinstance(step, Wait):
            return step.seconds
        return float(np.linalg.norm(step.by)) / LINE_SPEED if isinstance(step, Line) else self._timeline.period_s

    def check(self, states: Sequence[JobState]) -> None:
        """Raises `InvalidInstanceError` for a job that no arm, or not its arm, can do."""
        for state in states:
            moves = [k for k, step in enumerate(state.job.steps) if isinstance(step, Move)]
            arms = range(len(self._timeline.names)) if state.arm is None else [state.arm]
            if any(all(self._goals(state, k, arm) is not None for k in moves) for arm in arms):
                continue
            reasons = list(self._reasons(state, moves, arms))
            more = "" if state.arm is not None else "; no other arm can do the job either"
            raise InvalidInstanceError(reasons[0] + more)

    def _reasons(self, state: JobState, moves: Sequence[int], arms: Sequence[int]) -> Iterator[str]:
        for arm in arms:
            for step in moves:
                try:
                    self._first_goals(state, step, arm)
                except InvalidInstanceError as error:
                    yield str(error)
