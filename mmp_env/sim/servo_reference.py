"""Reference of the servos: position and velocity of all joints at any time of a plan.

A plan is linear between its times. A retimed plan has accelerations and equal steps h; its reference is the uniform
cubic B-spline with the samples as control points. The velocity, acceleration and jerk of the spline are averages of the
first, second and third divided differences of the samples. So the spline keeps the limits that the samples keep, at
every instant. It deviates from a sample by a h^2 / 6 at acceleration a. It begins one step earlier and ends one step
later than the plan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.plan import Plan

_EVEN = 1e-6
"""Largest relative difference of equal steps."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Pieces:
    """Pieces of the phase, each `step_s` [s] long, from `start_s` [s] on.

    `velocity` [rad/s], `acceleration` [rad/s^2] and `jerk` [rad/s^3] are the largest absolute values of the joints in
    each piece [p, n].
    """

    start_s: float
    step_s: float
    velocity: Float[np.ndarray, "p n"]
    acceleration: Float[np.ndarray, "p n"]
    jerk: Float[np.ndarray, "p n"]


class Reference:
    """A plan as functions of its time, for all joints [n] of the cell. Arms without a trajectory stay at rest.

    Args:
        plan: the plan.
        standing: a configuration of every arm [rad], in the order of the joints.
    """

    def __init__(self, plan: Plan, standing: Mapping[str, Float[np.ndarray, "dof"]]) -> None:
        count = len(plan.times)
        self.times = np.asarray(plan.times, dtype=float)
        still = {name: np.broadcast_to(0.0, (count, len(q))) for name, q in standing.items()}
        q = _joined(plan.positions, {name: np.broadcast_to(q, (count, len(q))) for name, q in standing.items()})
        self._controls = np.pad(q, ((2, 2), (0, 0)), mode="edge")
        self.q = self._controls[2:-2]  # a view: both are large in cells of many arms
        self.velocities = None if plan.velocities is None else _joined(plan.velocities, still)
        free = {name: np.full(len(q), np.inf) for name, q in standing.items()}
        self.max_acceleration = _joined(plan.max_acceleration or {}, free)
        self.max_jerk = _joined(plan.max_jerk or {}, free)
        steps = np.diff(self.times)
        even = count > 1 and bool((np.abs(steps - steps.mean()) <= _EVEN * steps.mean()).all())
        self.is_smooth = even and plan.velocities is not None and plan.accelerations is not None
        self._step_s = float(steps.mean()) if self.is_smooth else 0.0

    @property
    def start_s(self) -> float:
        """Begin in the time of the plan [s]; one step early for a spline."""
        return -self._step_s

    @property
    def end_s(self) -> float:
        """End in the time of the plan [s]; one step late for a spline."""
        return float(self.times[-1]) + self._step_s

    def at(self, clock: Float[np.ndarray, "t"]) -> tuple[Float[np.ndarray, "t n"], Float[np.ndarray, "t n"]]:
        """Returns positions [rad] and velocities [rad/s] at times of the plan [s]; at rest before and after."""
        if self.is_smooth:
            return self._spline(clock)
        piece = np.clip(np.searchsorted(self.times, clock, side="right") - 1, 0, max(len(self.times) - 2, 0))
        after = np.minimum(piece + 1, len(self.times) - 1)
        step = np.maximum(self.times[after] - self.times[piece], 1e-12)
        share = np.clip((clock - self.times[piece]) / step, 0.0, 1.0)
        if self.velocities is not None:
            return _mixed(self.q, piece, after, share), _mixed(self.velocities, piece, after, share)
        slopes = (self.q[after] - self.q[piece]) / step[:, None]
        return _mixed(self.q, piece, after, share), np.where((clock < self.end_s)[:, None], slopes, 0.0)

    def pieces(self) -> Pieces:
        """Returns the bounds of a spline for each of its pieces."""
        velocity = np.abs(np.diff(self._controls, axis=0)) / self._step_s
        acceleration = np.abs(np.diff(self._controls, n=2, axis=0)) / self._step_s**2
        return Pieces(
            start_s=self.start_s,
            step_s=self._step_s,
            velocity=np.maximum.reduce([velocity[:-2], velocity[1:-1], velocity[2:]]),
            acceleration=np.maximum(acceleration[:-1], acceleration[1:]),
            jerk=np.abs(np.diff(self._controls, n=3, axis=0)) / self._step_s**3,
        )

    def _spline(self, clock: Float[np.ndarray, "t"]) -> tuple[Float[np.ndarray, "t n"], Float[np.ndarray, "t n"]]:
        x = np.clip((clock - self.start_s) / self._step_s, 0.0, len(self.q) + 1.0)
        first = np.minimum(x.astype(int), len(self.q))
        x = (x - first)[:, None]
        p, q, r, s = (self._controls[first + k] for k in range(4))
        before, here, after = q - p, r - q, s - r
        position = q + (x**3 * after + (1 + 3 * x + 3 * x**2 - 2 * x**3) * here - (1 - x) ** 3 * before) / 6
        velocity = ((1 - x) ** 2 * before + (1 + 2 * x - 2 * x**2) * here + x**2 * after) / (2 * self._step_s)
        return position, velocity


def _joined(given: Mapping[str, np.ndarray], otherwise: Mapping[str, np.ndarray]) -> Float[np.ndarray, "*t n"]:
    return np.concatenate([np.asarray(given.get(name, rows), dtype=float) for name, rows in otherwise.items()], axis=-1)


def _mixed(
    rows: Float[np.ndarray, "t n"], piece: np.ndarray, after: np.ndarray, share: Float[np.ndarray, "m"]
) -> Float[np.ndarray, "m n"]:
    return rows[piece] * (1 - share)[:, None] + rows[after] * share[:, None]
