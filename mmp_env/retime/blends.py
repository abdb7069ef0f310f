"""Rounded corners: a path with continuous acceleration, made of a course and a blend at each of its corners.

A course is q_0 + v_0 u + sum_k d_k (u - u_k)_+ at phase u, with d_k the change of slope at corner k. A blend puts a
smooth ramp in the place of (u - u_k)_+: its mean over a window of width w, and again over one of width e. So slope and
second derivative are continuous. The second derivative is d_k / w between the edges, the third at most d_k / (w e).
The path changes only within (w + e) / 2 of a corner, which it misses by |d_k| (w + e^2 / 3w) / 8. A blend of width 0
is the corner itself, where the motion must stop.
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
    """A course with blends of `width` [c] and `edge` [c] (w and e, seconds of phase; e <= w) at its inner waypoints."""

    course: Course
    width: Float[np.ndarray, "c"]
    edge: Float[np.ndarray, "c"]

    @property
    def corners(self) -> Float[np.ndarray, "c"]:
        """Phases of the corners [s]."""
        return self.course.phases[1:-1]

    @property
    def reach(self) -> Float[np.ndarray, "c"]:
        """Distance [s of phase] of the beginning of each blend from its corner."""
        return (self.width + self.edge) / 2

    @property
    def stops(self) -> Float[np.ndarray, "m"]:
        """Phases [s] at which the motion must stop: corners without a blend."""
        return self.corners[self.width == 0]

    @property
    def miss(self) -> Float[np.ndarray, "c"]:
        """Distance [rad] at which each blend alone misses its corner, the largest of all joints."""
        least = np.maximum(self.width, _LEAST_S)
        return np.abs(self.course.turns).max(axis=1) * (self.width + self.edge**2 / (3 * least)) / 8

    def speeds(self, limits: RateLimits, curve: float, change: float) -> Float[np.ndarray, "c"]:
        """Returns the phase speeds at which blends use these shares of acceleration (`curve`) and jerk (`change`)."""
        turn = np.maximum(np.abs(self.course.turns), _LEAST_S)
        square = (limits.acceleration / turn).min(axis=1, initial=np.inf) * curve * self.width
        cube = (limits.jerk / turn).min(axis=1, initial=np.inf) * change * self.width * self.edge
        return np.minimum(np.sqrt(square), np.cbrt(cube))

    def narrower(self, factor: Float[np.ndarray, "c"]) -> BlendedPath:
        """Returns the path with the width of each blend times a factor; 0 makes the corner a stop.

        The speed at a blend changes by the root of its factor, and so does its edge, which then takes the same time and
        no more jerk.
        """
        width = self.width * factor
        return replace(self, width=width, edge=np.minimum(self.edge * np.sqrt(factor), width))

    @functools.cached_property
    def breaks(self) -> Float[np.ndarray, "b"]:
        """Phases [s] between which the path is one polynomial, ascending, with both ends."""
        outer, inner, at, end = self.reach, (self.width - self.edge) / 2, self.corners, self.course.end
        marks = np.unique(np.concatenate([at, at - outer, at + outer, at - inner, at + inner]))
        return np.concatenate([[0.0], marks[(marks > 0) & (marks < end)], [end]])

    def at(self, phase: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t n"]:
        """Returns configurations [rad] at phases."""
        return self.derivatives(phase, (0,))[0]

    def derivatives(
        self, phase: Float[np.ndarray, "t"], orders: Sequence[int], joints: slice = slice(None)
    ) -> list[Float[np.ndarray, "t _"]]:
        """Returns derivatives of the path by phase, of orders 0 to 3, of some joints; at a break those after it."""
        middles, parts = self._polynomials
        piece = np.searchsorted(self.breaks[1:-1], phase, side="right")
        x, parts = phase - middles[piece], [np.take(part[joints], piece, axis=1) for part in parts]
        out = []  # joints by phases: long rows are quicker
        for order in orders:
            value = parts[3]
            for k in reversed(range(order, 3)):
                value = value * (x / (k + 1 - order))
                value += parts[k]
            out.append(value.T)
        return out

    def off_course(self, phase: Float[np.ndarray, "t"], orders: Sequence[int] = (0,)) -> list[Float[np.ndarray, "t n"]]:
        """Returns the differences between path and course at ascending phases, and derivatives of them."""
        first = np.searchsorted(phase, self.corners - self.reach)
        last = np.searchsorted(phase, self.corners + self.reach)
        count = np.where(self.width > 0, last - first, 0)
        corner = np.repeat(np.arange(len(count)), count)
        row = np.arange(len(corner)) + np.repeat(first - np.cumsum(count) + count, count)
        by_row = np.argsort(row, kind="stable")
        corner, row = corner[by_row], row[by_row]
        more = _rounding(phase[row] - self.corners[corner], self.width[corner], self.edge[corner], orders)
        out = [np.zeros((len(phase), self.course.q.shape[1])) for _ in orders]
        # One blend of each phase at a time: NumPy adds to an index only once.
        nth = np.arange(len(row)) - np.searchsorted(row, row)
        for k in range(nth.max(initial=-1) + 1):
            here = np.flatnonzero(nth == k)
            turns = self.course.turns[corner[here]]
            for values, weight in zip(out, more, strict=True):
                values[row[here]] += weight[here, None] * turns
        return out

    @functools.cached_property
    def _polynomials(self) -> tuple[Float[np.ndarray, "p"], list[Float[np.ndarray, "n p"]]]:
        """Returns the middles of all polynomials [s], and the path and its derivatives there, orders 0 to 3."""
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
    """Returns the smooth ramp less the sharp one, x_+, and derivatives of that; `x` lies within the blend."""
    outer, inner = (width + edge) / 2, (width - edge) / 2
    beyond = np.maximum(x[:, None] + np.stack([outer, inner, -inner, -outer], axis=1), 0.0)
    sign = np.array([1.0, -1.0, -1.0, 1.0])
    sharp = (np.maximum(x, 0.0), (x >= 0).astype(float), 0.0, 0.0)
    square = beyond * beyond
    powers = (square * beyond / 6, square / 2, beyond, beyond > 0)
    return [powers[order] @ sign / (width * edge) - sharp[order] for order in orders]
