"""Corners rounded: a path with continuous acceleration, made of a course and a blend at each of its corners.

A course is q_0 + v_0 u + sum_k d_k (u - u_k)_+ at phase u, with d_k the change of slope at corner k. A blend puts a
smooth ramp in the place of (u - u_k)_+: its mean over a window of width w, and again over one of width e. So slope and
second derivative are continuous, the second one is d_k / w for the most part, and the third is d_k / (w e) at most.
Nothing changes farther than (w + e) / 2 from a corner; at it the path misses the corner by |d_k| (w + e^2 / 3w) / 8.
A blend without width is the corner itself, where the motion has to stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.retime.course import Course
from mmp_env.retime.limits import RateLimits

_LEAST_S = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class BlendedPath:
    """A course with blends of `width` [c] and `edge` [c] (w and e, seconds of phase; e <= w) at its inner knots."""

    course: Course
    width: Float[np.ndarray, "c"]
    edge: Float[np.ndarray, "c"]

    @property
    def corners(self) -> Float[np.ndarray, "c"]:
        """Phases of the corners [s]."""
        return self.course.knots[1:-1]

    @property
    def reach(self) -> Float[np.ndarray, "c"]:
        """How far from its corner each blend begins [s]."""
        return (self.width + self.edge) / 2

    @property
    def stops(self) -> Float[np.ndarray, "m"]:
        """Phases [s] at which the motion has to stop: corners without a blend."""
        return self.corners[self.width == 0]

    @property
    def miss(self) -> Float[np.ndarray, "c"]:
        """By how much each blend alone misses its corner [rad], at most over all joints."""
        least = np.maximum(self.width, _LEAST_S)
        return np.abs(self.course.turns).max(axis=1) * (self.width + self.edge**2 / (3 * least)) / 8

    def speeds(self, limits: RateLimits, curve: float, change: float) -> Float[np.ndarray, "c"]:
        """Speeds of the phase at which each blend takes these shares of acceleration (`curve`) and jerk (`change`)."""
        turn = np.maximum(np.abs(self.course.turns), _LEAST_S)
        square = (limits.acceleration / turn).min(axis=1, initial=np.inf) * curve * self.width
        cube = (limits.jerk / turn).min(axis=1, initial=np.inf) * change * self.width * self.edge
        return np.minimum(np.sqrt(square), np.cbrt(cube))

    def narrower(self, factor: Float[np.ndarray, "c"]) -> BlendedPath:
        """With the width of each blend times a factor, to be passed at the root of it in speed; 0 makes it a stop.

        An edge then takes as long as before and so no more jerk: it narrows by the root too, while there is width.
        """
        width = self.width * factor
        return replace(self, width=width, edge=np.minimum(self.edge * np.sqrt(factor), width))

    def breaks(self) -> Float[np.ndarray, "b"]:
        """Phases [s] between which the path is one polynomial, ascending, ends included."""
        outer, inner, at = self.reach, (self.width - self.edge) / 2, self.corners
        marks = np.concatenate([[0.0, self.course.end], at, at - outer, at + outer, at - inner, at + inner])
        return np.unique(marks.clip(0.0, self.course.end))

    def inside(self, phase: Float[np.ndarray, "t"]) -> Bool[np.ndarray, "t"]:
        """Whether each of ascending phases is within a blend."""
        edges = np.zeros(len(phase) + 1, int)
        np.add.at(edges, np.searchsorted(phase, self.corners - self.reach), 1)
        np.add.at(edges, np.searchsorted(phase, self.corners + self.reach), -1)
        return np.cumsum(edges)[:-1] > 0

    def at(self, phase: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t n"]:
        """Configurations [rad] at ascending phases."""
        return self.derivatives(phase, (0,))[0]

    def derivatives(self, phase: Float[np.ndarray, "t"], orders: Sequence[int]) -> list[Float[np.ndarray, "t n"]]:
        """The path (order 0) and derivatives of it by phase (1, 2), at ascending phases; of a stop's two slopes the
        later.
        """
        course = self.course
        out = [self._sharp(phase, order) for order in orders]
        first = np.searchsorted(phase, self.corners - self.reach)
        last = np.searchsorted(phase, self.corners + self.reach)
        for k in np.flatnonzero((last > first) & (self.width > 0)):
            part = slice(first[k], last[k])
            more = _rounding(phase[part] - self.corners[k], self.width[k], self.edge[k], orders)
            for values, weight in zip(out, more, strict=True):
                values[part] += weight[:, None] * course.turns[k]
        return out

    def _sharp(self, phase: Float[np.ndarray, "t"], order: int) -> Float[np.ndarray, "t n"]:
        course = self.course
        if order == 0:
            return course.at(phase)
        return course.slopes[course.piece(phase)] if order == 1 else np.zeros((len(phase), course.q.shape[1]))


def _rounding(
    x: Float[np.ndarray, "t"], width: float, edge: float, orders: Sequence[int]
) -> list[Float[np.ndarray, "t"]]:
    """A smooth ramp less the sharp one, x_+, and derivatives of that; `x` within the blend."""
    outer, inner = (width + edge) / 2, (width - edge) / 2
    beyond = np.maximum(x[:, None] + (outer, inner, -inner, -outer), 0.0)
    sign = np.array([1.0, -1.0, -1.0, 1.0]) / (width * edge)
    sharp = (np.maximum(x, 0.0), (x >= 0).astype(float), 0.0)
    return [beyond ** (3 - order) @ sign / (6, 2, 1)[order] - sharp[order] for order in orders]
