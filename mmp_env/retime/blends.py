"""Corners rounded: a path with continuous acceleration, made of a course and a blend at each of its corners.

A course is q_0 + v_0 u + sum_k d_k (u - u_k)_+ at phase u, with d_k the change of slope at corner k. A blend puts a
smooth ramp in the place of (u - u_k)_+: its mean over a window of width w, and again over one of width e. So slope and
second derivative are continuous, the second one is d_k / w for the most part, and the third is d_k / (w e) at most.
Nothing changes farther than (w + e) / 2 from a corner; at it the path misses the corner by |d_k| (w + e^2 / 3w) / 8.
A blend without width is the corner itself, where the motion has to stop.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

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

    @functools.cached_property
    def breaks(self) -> Float[np.ndarray, "b"]:
        """Phases [s] between which the path is one polynomial, ascending, ends included."""
        outer, inner, at, end = self.reach, (self.width - self.edge) / 2, self.corners, self.course.end
        marks = np.unique(np.concatenate([at, at - outer, at + outer, at - inner, at + inner]))
        return np.concatenate([[0.0], marks[(marks > 0) & (marks < end)], [end]])

    def at(self, phase: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t n"]:
        """Configurations [rad] at phases."""
        return self.derivatives(phase, (0,))[0]

    def derivatives(
        self, phase: Float[np.ndarray, "t"], orders: Sequence[int], joints: slice = slice(None)
    ) -> list[Float[np.ndarray, "t _"]]:
        """The path (order 0) and derivatives of it by phase (1, 2, 3), of some joints; of two at a break the later."""
        middles, parts = self._polynomials
        piece = np.searchsorted(self.breaks[1:-1], phase, side="right")
        x, parts = phase - middles[piece], [np.take(part[joints], piece, axis=1) for part in parts]
        out = []  # of joints by phases while it is worked out: long rows are quicker
        for order in orders:
            value = parts[3]
            for k in reversed(range(order, 3)):
                value = value * (x / (k + 1 - order))
                value += parts[k]
            out.append(value.T)
        return out

    def off_course(self, phase: Float[np.ndarray, "t"], orders: Sequence[int] = (0,)) -> list[Float[np.ndarray, "t n"]]:
        """What blends add to the course, and derivatives of that, at ascending phases; of order 3 not at breaks."""
        first = np.searchsorted(phase, self.corners - self.reach)
        last = np.searchsorted(phase, self.corners + self.reach)
        count = np.where(self.width > 0, last - first, 0)
        corner = np.repeat(np.arange(len(count)), count)
        row = np.arange(len(corner)) + np.repeat(first - np.cumsum(count) + count, count)
        by_row = np.argsort(row, kind="stable")
        corner, row = corner[by_row], row[by_row]
        more = _rounding(phase[row] - self.corners[corner], self.width[corner], self.edge[corner], orders)
        out = [np.zeros((len(phase), self.course.q.shape[1])) for _ in orders]
        # One blend of each phase at a time, so that none is written to twice at once.
        nth = np.arange(len(row)) - np.searchsorted(row, row)
        for k in range(nth.max(initial=-1) + 1):
            here = np.flatnonzero(nth == k)
            turns = self.course.turns[corner[here]]
            for values, weight in zip(out, more, strict=True):
                values[row[here]] += weight[here, None] * turns
        return out

    @functools.cached_property
    def _polynomials(self) -> tuple[Float[np.ndarray, "p"], list[Float[np.ndarray, "n p"]]]:
        """The middles of all polynomials [s], and there the path and its derivatives, orders 0 to 3."""
        middles, course = (self.breaks[1:] + self.breaks[:-1]) / 2, self.course
        parts = self.off_course(middles, (0, 1, 2, 3))
        parts[0] += course.at(middles)
        parts[1] += course.slopes[course.piece(middles)]
        return middles, [np.ascontiguousarray(part.T) for part in parts]


def _rounding(
    x: Float[np.ndarray, "t"],
    width: Float[np.ndarray, "t"],
    edge: Float[np.ndarray, "t"],
    orders: Sequence[int],
) -> list[Float[np.ndarray, "t"]]:
    """A smooth ramp less the sharp one, x_+, and derivatives of that; `x` within the blend."""
    outer, inner = (width + edge) / 2, (width - edge) / 2
    beyond = np.maximum(x[:, None] + np.stack([outer, inner, -inner, -outer], axis=1), 0.0)
    sign = np.array([1.0, -1.0, -1.0, 1.0])
    sharp = (np.maximum(x, 0.0), (x >= 0).astype(float), 0.0, 0.0)
    square = beyond * beyond
    powers = (square * beyond / 6, square / 2, beyond, beyond > 0)
    return [powers[order] @ sign / (width * edge) - sharp[order] for order in orders]
