"""Where a plan has all joints at any time, and how fast: what servos are told while a plan is executed.

Plans are linear between their times, with the velocities of their straight lines. A retimed plan has velocities and
accelerations; between its samples joints go on the polynomials of fifth degree that fit both, so that the motion stays
as smooth however its clock passes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from mmp_env.plan import Plan


class Reference:
    """A plan as functions of time; joints [n] side by side, those of arms that it does not move at rest."""

    def __init__(self, plan: Plan, standing: Mapping[str, Float[np.ndarray, "dof"]]) -> None:
        """`standing`: a configuration of every arm, in the order of the joints."""
        count = len(plan.times)
        self.times = np.asarray(plan.times, dtype=float)
        still = {name: np.zeros((count, len(q))) for name, q in standing.items()}
        self.q = _joined(plan.positions, {name: np.tile(q, (count, 1)) for name, q in standing.items()})
        self.velocities = None if plan.velocities is None else _joined(plan.velocities, still)
        self.accelerations = None if plan.accelerations is None else _joined(plan.accelerations, still)
        free = {name: np.full(len(q), np.inf) for name, q in standing.items()}
        self.max_acceleration = _joined(plan.max_acceleration or {}, free)
        self.max_jerk = _joined(plan.max_jerk or {}, free)

    @property
    def end_s(self) -> float:
        """The last time of the plan."""
        return float(self.times[-1])

    def at(self, clock: Float[np.ndarray, "t"]) -> tuple[Float[np.ndarray, "t n"], Float[np.ndarray, "t n"]]:
        """Positions [rad] and velocities [rad/s] at times from 0 [s]; at rest after the end."""
        piece = np.clip(np.searchsorted(self.times, clock, side="right") - 1, 0, max(len(self.times) - 2, 0))
        after = np.minimum(piece + 1, len(self.times) - 1)
        step = np.maximum(self.times[after] - self.times[piece], 1e-12)
        share = np.clip((clock - self.times[piece]) / step, 0.0, 1.0)
        if self.velocities is None:
            slopes = (self.q[after] - self.q[piece]) / step[:, None]
            return _mixed(self.q, piece, after, share), np.where((clock < self.end_s)[:, None], slopes, 0.0)
        if self.accelerations is None:
            return _mixed(self.q, piece, after, share), _mixed(self.velocities, piece, after, share)
        x, h = share[:, None], step[:, None]
        begin, end = ((self.q[row], h * self.velocities[row], h**2 * self.accelerations[row]) for row in (piece, after))
        position, velocity = _quintic(x, begin, end)
        return position, velocity / h


Row = tuple[Float[np.ndarray, "t n"], Float[np.ndarray, "t n"], Float[np.ndarray, "t n"]]


def _quintic(x: Float[np.ndarray, "t 1"], begin: Row, end: Row) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope at `x` in [0, 1] of the polynomial with these values, slopes and curvatures at 0 and 1."""
    at, rate, growth = begin
    off, off_rate, off_growth = end[0] - at - rate - growth / 2, end[1] - rate - growth, end[2] - growth
    third = 10 * off - 4 * off_rate + off_growth / 2
    fourth = -15 * off + 7 * off_rate - off_growth
    fifth = 6 * off - 3 * off_rate + off_growth / 2
    value = at + x * (rate + x * (growth / 2 + x * (third + x * (fourth + x * fifth))))
    return value, rate + x * (growth + x * (3 * third + x * (4 * fourth + x * 5 * fifth)))


def _joined(given: Mapping[str, np.ndarray], otherwise: Mapping[str, np.ndarray]) -> Float[np.ndarray, "*t n"]:
    return np.concatenate([np.asarray(given.get(name, rows), dtype=float) for name, rows in otherwise.items()], axis=-1)


def _mixed(
    rows: Float[np.ndarray, "t n"], piece: np.ndarray, after: np.ndarray, share: Float[np.ndarray, "m"]
) -> Float[np.ndarray, "m n"]:
    return rows[piece] * (1 - share)[:, None] + rows[after] * share[:, None]
