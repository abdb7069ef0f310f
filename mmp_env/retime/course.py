"""A course: straight lines through the waypoints of a plan over a phase, which all arms share.

The phase is the least time [s] that the joints' velocities allow: on every line one joint is at its limit. Another
clock for the phase changes the times of the motion and not its path, so it causes no conflict.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.model.plan import Plan
from mmp_env.retime.limits import joined

_STRAIGHT = 1e-7
"""Smallest change of slope that is a corner, relative to the velocities."""
_STILL_S = 1e-9
"""Shortest line [s of phase]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """Waypoints `q` [k, n] [rad] at `phases` [k] [s], ascending from 0; `slopes` [k - 1, n] [rad/s] between them."""

    phases: Float[np.ndarray, "k"]
    q: Float[np.ndarray, "k n"]
    slopes: Float[np.ndarray, "s n"]

    @property
    def end(self) -> float:
        """The last phase: the makespan [s] that velocities alone allow."""
        return float(self.phases[-1])

    @functools.cached_property
    def turns(self) -> Float[np.ndarray, "c n"]:
        """Returns the change of the slope at each inner waypoint [rad/s]."""
        return np.diff(self.slopes, axis=0)

    def piece(self, phase: Float[np.ndarray, "t"]) -> Int[np.ndarray, "t"]:
        """Returns the index of the line at each phase, of the later line at a waypoint."""
        return np.clip(np.searchsorted(self.phases, phase, side="right") - 1, 0, len(self.slopes) - 1)

    def at(self, phase: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t n"]:
        """Returns configurations [rad] at phases."""
        piece = self.piece(phase)
        return self.q[piece] + self.slopes[piece] * (phase - self.phases[piece])[:, None]


def course_of(plan: Plan, velocity: Float[np.ndarray, "n"]) -> Course:
    """Returns the course of a plan at these velocities, without waits of all arms and waypoints on straight lines."""
    q = joined(plan.problem.cell, plan.positions)
    q = q[_kept(_step_durations(q, velocity) > _STILL_S)]
    while len(q) > 2:  # rounding may hide a waypoint the first time
        slopes = np.diff(q, axis=0) / _step_durations(q, velocity)[:, None]
        bends = (np.abs(np.diff(slopes, axis=0)) / velocity).max(axis=1) > _STRAIGHT
        # Removes every other neighbour at a time: many small bends are not a straight line.
        bends[1::2] |= ~bends[:-1:2][: len(bends[1::2])]
        if bends.all():
            break
        q = q[np.concatenate([[True], bends, [True]])]
    lasting = _step_durations(q, velocity)
    slopes = np.diff(q, axis=0) / np.where(lasting > 0, lasting, 1.0)[:, None]
    return Course(phases=np.concatenate([[0.0], np.cumsum(lasting)]), q=q, slopes=slopes)


def _step_durations(q: Float[np.ndarray, "k n"], velocity: Float[np.ndarray, "n"]) -> Float[np.ndarray, "s"]:
    return (np.abs(np.diff(q, axis=0)) / velocity).max(axis=1)


def _kept(moving: Bool[np.ndarray, "s"]) -> Bool[np.ndarray, "k"]:
    """Returns the rows after a motion, the first and the last one. The last one replaces an equal row before it."""
    kept = np.concatenate([[True], moving])
    if not kept[-1]:
        kept[np.flatnonzero(kept)[-1]] = len(kept) == 1 or not kept[1:].any()
        kept[-1] = True
    return kept
