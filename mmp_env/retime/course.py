"""A course: straight lines through the configurations of a plan, at the phase at which every joint could be there.

The phase is the least time [s] that the joints' velocities allow: on every straight line one of them is at its limit.
All arms share it, so whoever changes only how fast it passes changes nothing of what the arms meet.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.model.plan import Plan
from mmp_env.retime.limits import joined

_STRAIGHT = 1e-7
"""A change of direction smaller than this share of the velocities is none."""
_STILL_S = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """`knots` [k] [s], ascending from 0; `q` [k, n] [rad] there; `slopes` [k - 1, n] [rad/s] between them."""

    knots: Float[np.ndarray, "k"]
    q: Float[np.ndarray, "k n"]
    slopes: Float[np.ndarray, "s n"]

    @property
    def end(self) -> float:
        """The last phase: the makespan [s] that velocities alone allow."""
        return float(self.knots[-1])

    @functools.cached_property
    def turns(self) -> Float[np.ndarray, "c n"]:
        """By how much the slope changes at each inner knot [rad/s]."""
        return np.diff(self.slopes, axis=0)

    def piece(self, phase: Float[np.ndarray, "t"]) -> Int[np.ndarray, "t"]:
        """Which of the straight lines each phase is on; the later one at a knot."""
        return np.clip(np.searchsorted(self.knots, phase, side="right") - 1, 0, len(self.slopes) - 1)

    def at(self, phase: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t n"]:
        """Configurations [rad] at phases."""
        piece = self.piece(phase)
        return self.q[piece] + self.slopes[piece] * (phase - self.knots[piece])[:, None]


def course_of(plan: Plan, velocity: Float[np.ndarray, "n"]) -> Course:
    """The course of a plan at these velocities; waits of all arms, and knots where nothing turns, are left out."""
    q = joined(plan.problem.cell, plan.positions)
    q = q[_kept(_step_durations(q, velocity) > _STILL_S)]
    while len(q) > 2:  # once is enough but for what rounding hides
        slopes = np.diff(q, axis=0) / _step_durations(q, velocity)[:, None]
        bends = (np.abs(np.diff(slopes, axis=0)) / velocity).max(axis=1) > _STRAIGHT
        # Of neighbours only every other one goes at once: many small bends are not a straight line.
        bends[1::2] |= ~bends[:-1:2][: len(bends[1::2])]
        if bends.all():
            break
        q = q[np.concatenate([[True], bends, [True]])]
    lasting = _step_durations(q, velocity)
    slopes = np.diff(q, axis=0) / np.maximum(lasting, _STILL_S)[:, None]
    return Course(knots=np.concatenate([[0.0], np.cumsum(lasting)]), q=q, slopes=slopes)


def _step_durations(q: Float[np.ndarray, "k n"], velocity: Float[np.ndarray, "n"]) -> Float[np.ndarray, "s"]:
    return (np.abs(np.diff(q, axis=0)) / velocity).max(axis=1)


def _kept(moving: Bool[np.ndarray, "s"]) -> Bool[np.ndarray, "k"]:
    """Rows that a motion leads to, and the first; the last one in any case, in the place of what comes to it."""
    kept = np.concatenate([[True], moving])
    if not kept[-1]:
        kept[np.flatnonzero(kept)[-1]] = len(kept) == 1 or not kept[1:].any()
        kept[-1] = True
    return kept
