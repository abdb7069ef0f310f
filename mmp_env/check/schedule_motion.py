"""The motion of one arm in a schedule: a uniform cubic B-spline through the samples of the file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from mmp_env.check.fields import UnreadableError

STRAY = 5e-6
"""Largest distance [rad or m] of a joint from straight lines between the times at which the motion is proved."""
MOST_PARTS = 5e6
"""Largest number of lines in a check."""
MOST_JUMP = 1e4
"""Largest move of a joint [rad or m] in a period of a check. No plan that turns farther is proved."""
REST_TOLERANCE = 1e-9
"""Largest move of a joint [rad or m] of an arm at rest."""
_BASIS = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6
"""Coefficients of 1, x, x^2 and x^3 for the four control points around a period."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """The motion of one arm: control points [t, dof] [rad or m] at `times` [t] [s], multiples of `period` [s].

    Control points that are left out are on the straight line between their neighbours. The arm rests before and after.
    """

    times: Float[np.ndarray, "t"]
    positions: Float[np.ndarray, "t dof"]
    period: float

    @cached_property
    def controls(self) -> Float[np.ndarray, "k dof"]:
        """The control points of all periods."""
        given = np.round(self.times / self.period).astype(int)
        share = np.arange(given[-1] + 1)
        return np.stack([np.interp(share, given, column) for column in self.positions.T], axis=1)

    @property
    def end(self) -> float:
        """The last time [s]."""
        return float(self.times[-1])

    def at(self, times: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
        """Returns the configurations at times [s]."""
        last = len(self.controls) - 1
        steps = np.clip(times / self.period, 0, last)
        first = np.clip(np.floor(steps).astype(int), 0, max(last - 1, 0))
        x = steps - first
        weights = np.stack([np.ones_like(x), x, x * x, x * x * x], axis=1) @ _BASIS
        around = np.clip(first[:, None] + np.arange(-1, 3), 0, last)
        # Differences from one of the points, so that an arm at rest does not move by rounding.
        origin = self.controls[first]
        return origin + np.einsum("nk,nkd->nd", weights, self.controls[around] - origin[:, None])

    def bend(self) -> Float[np.ndarray, "k dof"]:
        """Returns how far each joint is at most from a straight line during each period [rad or m]."""
        padded = np.pad(self.controls, ((1, 1), (0, 0)), mode="edge")
        second = np.abs(padded[2:] - 2 * padded[1:-1] + padded[:-2])
        return np.maximum(second[:-1], second[1:]) / 8

    def parts(self) -> Int[np.ndarray, "k"]:
        """Returns in how many parts each period is cut, so that no joint strays by more than `STRAY` from lines."""
        return np.ceil(np.sqrt(np.maximum(self.bend().max(axis=1) / STRAY, 1))).astype(int)

    def moves(self, begin: float, end: float) -> bool:
        """Returns whether the arm moves between two times [s]."""
        begin, end = np.clip([begin, end], 0.0, self.end)
        first, last = begin / self.period, end / self.period
        between = np.arange(np.ceil(first - 1e-6), np.floor(last + 1e-6) + 1) * self.period
        rows = self.at(np.concatenate([[begin], between.clip(begin, max(begin, end)), [end]]))
        return bool(np.ptp(rows, axis=0).max() > REST_TOLERANCE)


def proof_times(motions: list[Motion]) -> Float[np.ndarray, "t"]:
    """Returns times [s] for all arms, between which every motion is straight but for `STRAY`."""
    count = max(len(motion.controls) for motion in motions) - 1
    jump = max(float(np.abs(np.diff(motion.controls, axis=0)).max(initial=0)) for motion in motions)
    lines = sum(np.sqrt(motion.bend().max(axis=1) / STRAY + 1).sum() for motion in motions)
    if not (jump <= MOST_JUMP and lines <= MOST_PARTS):
        raise UnreadableError("the positions of an arm jump so far that the motion between them cannot be checked")
    parts = np.ones(count, dtype=int)
    for motion in motions:
        own = motion.parts()
        parts[: len(own)] = np.maximum(parts[: len(own)], own)
    begin = np.repeat(np.arange(count), parts)
    share = np.concatenate([np.arange(n) / n for n in parts]) if count else np.zeros(0)
    return motions[0].period * np.append(begin + share, count)
