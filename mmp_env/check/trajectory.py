"""The motion of a plan, straight in joint space between its samples, and its steps."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.items import MotionSteps
from mmp_env.check.model import CellModel
from mmp_env.check.rules import largest_moves

_STEP = 0.1
"""Largest move [rad or m] of a joint in a first step. Longer lines are cut; short ones form one step."""


class Trajectory:
    """Configurations `q` [t, n] [rad or m] at `times` [t] [s]. Place 2.5 is midway between samples 2 and 3."""

    def __init__(self, times: Float[np.ndarray, "t"], q: Float[np.ndarray, "t n"]) -> None:
        if len(times) == 1:  # a lone configuration is a step without motion
            times, q = np.repeat(times, 2), np.repeat(q, 2, axis=0)
        self._times, self._q = times, q

    def grid(self) -> Float[np.ndarray, "m"]:
        """Returns the places at which the first steps begin and end."""
        places, moved = [0.0], 0.0
        for k, move in enumerate(largest_moves(self._q).tolist()):
            if moved + move > _STEP and places[-1] < k:
                places.append(float(k))
                moved = 0.0
            pieces = int(np.ceil(move / _STEP))
            if pieces > 1:
                places.extend((k + np.arange(1, pieces + 1) / pieces).tolist())
            else:
                moved += move
        if places[-1] < len(self._q) - 1:
            places.append(float(len(self._q) - 1))
        return np.array(places)

    def at(self, places: Float[np.ndarray, "m"]) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m n"]]:
        """Returns times [s] and configurations [rad or m] at places."""
        low = np.minimum(places.astype(int), len(self._q) - 2)
        share = places - low
        times = self._times[low] * (1 - share) + self._times[low + 1] * share
        return times, self._q[low] * (1 - share)[:, None] + self._q[low + 1] * share[:, None]

    def bend(self, first: int, last: int) -> Float[np.ndarray, "n"]:
        """Returns an upper bound on each joint's distance [rad or m] from a straight line between two samples."""
        share = np.linspace(0.0, 1.0, last - first + 1)[:, None]
        straight = self._q[first] + share * (self._q[last] - self._q[first])  # exact where nothing moves
        straight[-1] = self._q[last]
        return np.abs(self._q[first : last + 1] - straight).max(axis=0)


class PlacedTrajectory:
    """The cell placed along a trajectory: `poses`, and the `steps` between pairs of them that are measured next."""

    def __init__(self, model: CellModel, trajectory: Trajectory, places: Float[np.ndarray, "m"]) -> None:
        self._model, self._trajectory, self._places = model, trajectory, places
        self.poses = model.poses(*trajectory.at(places))
        first = np.arange(len(places) - 1)
        self.steps = self._steps(first, first + 1)

    def halve(self, chosen: Int[np.ndarray, "k"]) -> None:
        """Replaces the steps by the halves of the chosen ones: all first halves, then all second ones."""
        start, end = self.steps.start[chosen], self.steps.end[chosen]
        low, high = self._places[start], self._places[end]
        # At a sample if the step holds one: between two samples the joints go straight.
        middle = np.where(high - low > 1, np.floor((low + high) / 2), (low + high) / 2)
        at = len(self._places) + np.arange(len(chosen))
        self._places = np.concatenate([self._places, middle])
        self.poses = self.poses + self._model.poses(*self._trajectory.at(middle))
        self.steps = self._steps(np.concatenate([start, at]), np.concatenate([at, end]))

    def _steps(self, start: Int[np.ndarray, "u"], end: Int[np.ndarray, "u"]) -> MotionSteps:
        move = np.abs(self.poses.q[end] - self.poses.q[start])
        bend = np.zeros_like(move)
        low, high = self._places[start], self._places[end]
        for k in np.flatnonzero(high - low > 1):
            bend[k] = self._trajectory.bend(int(low[k]), int(high[k]))
        return MotionSteps(start=start, end=end, move=move, bend=bend)
