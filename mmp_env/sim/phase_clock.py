"""Clock of the phase of a retimed plan: it stops and starts the execution within the limits of the joints.

At speed s of the phase a joint has velocity q's, acceleration q''s^2 + q's' and jerk q'''s^3 + 3q''ss' + q's''. A plan
that was retimed with a share of its limits leaves the rest for s' and s'': bounds A and J for each piece of the plan.
A ramp from one speed to another begins and ends with s' = 0. It takes the least A and J of the pieces it can reach.
A change of the target within a ramp first brings s' to 0 with the J of the ramp, which ends before the ramp would have
ended. So every ramp can be completed within the limits, however often the target changes.
"""

from __future__ import annotations

import copy
import math

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.sim.servo_reference import Pieces, Reference

LONGEST_STOP_S = 20.0
"""Longest time to come to rest for which a plan counts as having a reserve."""
_MOST, _TINY, _SAME = 1e3, 1e-9, 1e-12


class PhaseClock:
    """The phase of an execution.

    `phase` [s] is the time of the plan, `speed` its derivative (1: as planned), `acceleration` [1/s] that of the speed.

    Raises:
        MmpError: for a plan that is not retimed, or was retimed without a reserve.
    """

    def __init__(self, reference: Reference) -> None:
        if not reference.is_smooth:
            raise MmpError(
                "a monitor needs a plan that has velocities and accelerations at equal steps of time; retime it first"
            )
        pieces = reference.pieces()
        self._accelerations, self._jerks = _reserve(pieces, reference.max_acceleration, reference.max_jerk)
        self._ends = pieces.start_s + pieces.step_s * np.arange(1, len(self._accelerations) + 1)
        if not _longest_stop_s(self._accelerations, self._jerks) <= LONGEST_STOP_S:
            raise MmpError(
                f"the plan is at its limits, so it cannot be brought to rest within {LONGEST_STOP_S:g} s; retime it "
                "with a share below 1"
            )
        self._last_s, self._end_s = float(reference.times[-1]), reference.end_s
        self.phase, self.speed, self.acceleration = reference.start_s, 1.0, 0.0
        self._target, self._jerk = 1.0, 0.0
        self._segments: list[tuple[float, float]] = []  # (duration [s], s'' [1/s^2]), the next one first

    @property
    def at_rest(self) -> bool:
        """Whether the phase stands still."""
        return self.speed == 0.0

    @property
    def plan_s(self) -> float:
        """The phase, within the times of the plan [s]."""
        return min(max(self.phase, 0.0), self._last_s)

    @property
    def over(self) -> bool:
        """Whether the plan is at its end."""
        return self.phase >= self._end_s - _TINY

    def copy(self) -> PhaseClock:
        """Returns a clock in the same state."""
        other = copy.copy(self)
        other._segments = list(self._segments)
        return other

    def set_target(self, target: float) -> None:
        """Changes the speed to `target`, 0 or 1, as fast as the limits of the joints allow."""
        if target == self._target:
            return
        self._target = target
        easing = -math.copysign(self._jerk, self.acceleration)
        self._segments = [(abs(self.acceleration) / self._jerk, easing)] if self.acceleration else []

    def advance(self, step_s: float) -> None:
        """Advances the phase by `step_s` [s] of the execution."""
        while step_s > 0:
            if not self._segments:
                if self.speed == self._target:
                    self._integrate(step_s, 0.0)
                    return
                self._segments = self._ramp_to_target()
            duration, jerk = self._segments.pop(0)
            passed = min(duration, step_s)
            self._integrate(passed, jerk)
            step_s -= passed
            if passed < duration:
                self._segments.insert(0, (duration - passed, jerk))
            elif not self._segments:
                self.acceleration = 0.0
                if abs(self.speed - self._target) < _SAME:
                    self.speed = self._target

    def _integrate(self, duration_s: float, jerk: float) -> None:
        t, v, a = duration_s, self.speed, self.acceleration
        forward = t * (v + t * (a / 2 + t * jerk / 6))
        # Rounding must not decrease the phase.
        self.phase = min(self.phase + max(forward, 0.0), self._end_s)
        self.speed, self.acceleration = min(max(v + t * (a + t * jerk / 2), 0.0), 1.0), a + t * jerk

    def _ramp_to_target(self) -> list[tuple[float, float]]:
        """Returns the segments of the ramp to the target, within the bounds of the pieces that it can reach."""
        here = min(int(np.searchsorted(self._ends, self.phase, side="right")), len(self._ends) - 1)
        change = self._target - self.speed
        accelerations, jerks = (np.minimum.accumulate(bounds[here:]) for bounds in (self._accelerations, self._jerks))
        begin, even = _ramp(abs(change), accelerations, jerks)
        # The bound assumes the higher speed for the whole ramp, so a change of the target stays within these pieces.
        farthest = self.phase + max(self._target, self.speed) * (2 * begin + even)
        fits = farthest <= self._ends[here:]
        k = int(np.argmax(fits)) if fits.any() else len(fits) - 1
        self._jerk = float(jerks[k])
        outer, inner = float(begin[k]), float(even[k])
        return [(outer, math.copysign(self._jerk, change)), (inner, 0.0), (outer, -math.copysign(self._jerk, change))]


def _ramp(
    change: float, acceleration: Float[np.ndarray, "p"], jerk: Float[np.ndarray, "p"]
) -> tuple[Float[np.ndarray, "p"], Float[np.ndarray, "p"]]:
    """Returns the durations [s] of the outer segments, in which |s'| grows or shrinks, and of the middle segment.

    s changes by `change`, with |s'| up to `acceleration` and |s''| up to `jerk`.
    """
    top = np.minimum(acceleration, np.sqrt(change * jerk))
    return top / jerk, np.maximum(change / top - top / jerk, 0.0)


def _longest_stop_s(accelerations: Float[np.ndarray, "p"], jerks: Float[np.ndarray, "p"]) -> float:
    """Returns the time to rest with the least bounds [s]; infinite without a reserve."""
    if not min(accelerations.min(), jerks.min()) > 0:
        return math.inf
    begin, even = _ramp(1.0, accelerations.min(keepdims=True), jerks.min(keepdims=True))
    return float(2 * begin[0] + even[0])


def _reserve(
    pieces: Pieces, max_acceleration: Float[np.ndarray, "n"], max_jerk: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "p"], Float[np.ndarray, "p"]]:
    """Returns A [1/s] and J [1/s^2], bounds of |s'| and |s''| in each piece for s from 0 to 1; 0 or less at a limit."""
    velocity, curve = np.maximum(pieces.velocity, _TINY), np.maximum(pieces.acceleration, _TINY)
    left = max_jerk - pieces.jerk
    # Half of the remaining jerk is for the middle term, the other half for s''.
    bound = np.minimum((max_acceleration - pieces.acceleration) / velocity, left / (6 * curve))
    acceleration = bound.min(axis=1).clip(max=_MOST)
    jerk = ((left - 3 * curve * acceleration[:, None]) / velocity).min(axis=1).clip(max=_MOST**2)
    return acceleration, jerk
