"""The motion of one arm in a schedule: a smooth curve through equal periods of time.

The curve is the uniform cubic B-spline whose control points are the samples. Its velocity, acceleration and jerk lie
between the divided differences of the samples, so it keeps every limit that the samples keep. An arm that has two equal
samples before and after a motion is at rest at both ends of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from mmp_env.model.read_only import ReadOnly

PERIOD_S = 0.02
"""Period of the samples of a schedule [s]."""
STRAY_RAD = 5e-6
"""Largest distance [rad, of slides m] of the curve from straight lines between the times at which a proof takes it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory(ReadOnly):
    """The motion of one arm from the first job to the last.

    Attributes:
        times: [t] [s], ascending multiples of the period from 0. Samples are left out where they are on straight lines
            between two others, so where the arm stands still.
        positions: samples [t, dof] [rad, of slides m] at these times.
        period_s: the period [s].
    """

    times: Float[np.ndarray, "t"]
    positions: Float[np.ndarray, "t dof"]
    period_s: float = PERIOD_S

    @cached_property
    def samples(self) -> Float[np.ndarray, "k dof"]:
        """The samples at all multiples of the period up to the last time."""
        steps = np.arange(round(float(self.times[-1]) / self.period_s) + 1)
        known = np.round(self.times / self.period_s)
        return np.column_stack([np.interp(steps, known, column) for column in self.positions.T])

    def at(self, times: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
        """Returns the configurations [n, dof] on the curve at `times` [n] [s]."""
        return spline(self.samples, np.asarray(times, dtype=float) / self.period_s)

    def velocity(self, times: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
        """Returns the velocities [n, dof] [rad/s, of slides m/s] at `times` [n] [s]."""
        return spline_slope(self.samples, np.asarray(times, dtype=float) / self.period_s) / self.period_s

    def moves(self, begin_s: float, end_s: float) -> bool:
        """Returns whether the arm moves between two multiples of the period [s]."""
        begin, end = round(begin_s / self.period_s), round(end_s / self.period_s)
        rows = self.samples[begin : end + 1]
        return bool(len(rows) and (rows != rows[0]).any())

    def parts(self) -> Int[np.ndarray, "p"]:
        """Returns in how many parts a proof cuts each period, so that the curve strays by `STRAY_RAD` at most."""
        bend = np.abs(np.diff(np.pad(self.samples, ((1, 1), (0, 0)), mode="edge"), n=2, axis=0)).max(axis=1)
        return np.maximum(np.ceil(np.sqrt(np.maximum(bend[:-1], bend[1:]) / (8 * STRAY_RAD))), 1).astype(int)


def spline(samples: Float[np.ndarray, "k dof"], steps: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
    """Returns points of the B-spline at times in periods. It rests at the first and after the last sample."""
    p, q, r, s, x = _controls(samples, steps)
    before, here, after = q - p, r - q, s - r
    return q + (x**3 * after + (1 + 3 * x + 3 * x**2 - 2 * x**3) * here - (1 - x) ** 3 * before) / 6


def spline_slope(samples: Float[np.ndarray, "k dof"], steps: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
    """Returns the change per period of the B-spline at times in periods."""
    p, q, r, s, x = _controls(samples, steps)
    return ((1 - x) ** 2 * (q - p) + (1 + 2 * x - 2 * x**2) * (r - q) + x**2 * (s - r)) / 2


def _controls(samples: Float[np.ndarray, "k dof"], steps: Float[np.ndarray, "n"]) -> list[Float[np.ndarray, "n _"]]:
    """Returns the four control points of each time, and how far it is in its period."""
    last = len(samples) - 1
    steps = np.clip(steps, 0.0, last)
    first = np.minimum(np.floor(steps).astype(int), max(last - 1, 0))
    around = [samples[np.clip(first + k, 0, last)] for k in (-1, 0, 1, 2)]
    return [*around, (steps - first)[:, None]]


def thinned(samples: Float[np.ndarray, "k dof"], period_s: float = PERIOD_S) -> Trajectory:
    """Returns the trajectory of samples, without those inside times at which the arm stands still."""
    moves = (np.diff(samples, axis=0) != 0).any(axis=1)
    keep = np.concatenate([[True], moves]) | np.concatenate([moves, [True]])
    times = np.array([time_of(int(k), period_s) for k in np.flatnonzero(keep)])
    return Trajectory(times=times, positions=samples[keep], period_s=period_s)


def time_of(period: int, period_s: float = PERIOD_S) -> float:
    """Returns the time after a number of periods [s], without the rounding error of their product."""
    return round(period * period_s, 9)
