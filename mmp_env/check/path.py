"""The motion of a plan: straight lines between the configurations of its samples, and how to cut it into steps."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.items import Steps
from mmp_env.check.model import CellModel

_STEP_RAD = 0.1
"""Steps to begin with: longer lines are cut, short ones taken together."""


class Path:
    """Configurations `q` [t, n] [rad] at `times` [t] [s]. Place 2.5 on the path is midway from sample 2 to sample 3."""

    def __init__(self, times: Float[np.ndarray, "t"], q: Float[np.ndarray, "t n"]) -> None:
        if len(times) == 1:  # a lone configuration is a step without motion
            times, q = np.repeat(times, 2), np.repeat(q, 2, axis=0)
        self._times, self._q = times, q

    def grid(self) -> Float[np.ndarray, "m"]:
        """Places between which no joint turns far."""
        places, turned = [0.0], 0.0
        for k, turn in enumerate(np.abs(np.diff(self._q, axis=0)).max(axis=1).tolist()):
            if turned + turn > _STEP_RAD and places[-1] < k:
                places.append(float(k))
                turned = 0.0
            pieces = int(np.ceil(turn / _STEP_RAD))
            if pieces > 1:
                places.extend((k + np.arange(1, pieces + 1) / pieces).tolist())
            else:
                turned += turn
        if places[-1] < len(self._q) - 1:
            places.append(float(len(self._q) - 1))
        return np.array(places)

    def at(self, places: Float[np.ndarray, "m"]) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m n"]]:
        """Times [s] and configurations [rad] at places."""
        low = np.minimum(places.astype(int), len(self._q) - 2)
        share = places - low
        times = self._times[low] * (1 - share) + self._times[low + 1] * share
        return times, self._q[low] * (1 - share)[:, None] + self._q[low + 1] * share[:, None]

    def bend(self, first: int, last: int) -> Float[np.ndarray, "n"]:
        """How far each joint is from going straight between two samples, at most [rad]."""
        share = np.linspace(0.0, 1.0, last - first + 1)[:, None]
        straight = self._q[first] * (1 - share) + self._q[last] * share
        return np.abs(self._q[first : last + 1] - straight).max(axis=0)


class Track:
    """A path with the cell placed along it: `poses`, and the `steps` between some of them that are looked at."""

    def __init__(self, model: CellModel, path: Path, places: Float[np.ndarray, "m"]) -> None:
        """The steps between consecutive places."""
        self._model, self._path, self._places = model, path, places
        self.poses = model.poses(*path.at(places))
        first = np.arange(len(places) - 1)
        self.steps = self._steps(first, first + 1)

    def halve(self, chosen: Int[np.ndarray, "k"]) -> None:
        """Looks at the halves of some of the steps: all first halves, and then all second ones."""
        start, end = self.steps.start[chosen], self.steps.end[chosen]
        low, high = self._places[start], self._places[end]
        # At a sample, where there is one within: between two samples the joints go straight.
        middle = np.where(high - low > 1, np.floor((low + high) / 2), (low + high) / 2)
        at = len(self._places) + np.arange(len(chosen))
        self._places = np.concatenate([self._places, middle])
        self.poses = self.poses + self._model.poses(*self._path.at(middle))
        self.steps = self._steps(np.concatenate([start, at]), np.concatenate([at, end]))

    def _steps(self, start: Int[np.ndarray, "u"], end: Int[np.ndarray, "u"]) -> Steps:
        turn = np.abs(self.poses.q[end] - self.poses.q[start])
        bend = np.zeros_like(turn)
        low, high = self._places[start], self._places[end]
        for k in np.flatnonzero(high - low > 1):
            bend[k] = self._path.bend(int(low[k]), int(high[k]))
        return Steps(start=start, end=end, turn=turn, bend=bend)
