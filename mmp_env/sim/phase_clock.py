"""The phase of a retimed plan while it is executed: brought to rest and up to speed again, within joints' limits.

At speed s of the phase a joint has velocity q's, acceleration q''s^2 + q's' and jerk q'''s^3 + 3q''ss' + q's''. A plan
that was retimed with a share of its limits leaves the rest of them for s' and s'': bounds G and J for each piece of it.
A ramp from one speed to another begins and ends with s' = 0 and takes the least G and J of all pieces that it can come
to. Who turns round in a ramp first brings s' to 0 with its J, which ends before the ramp would have: so wherever
somebody turns, and however often, what is begun can be ended within limits.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.sim.servo_reference import Pieces, Reference

LONGEST_STOP_S = 20.0
"""A plan that takes longer to come to rest leaves nothing worth the name."""
_MOST, _TINY, _SAME = 1e3, 1e-9, 1e-12


class PhaseClock:
    """`phase` [s] is the plan's time, `speed` how fast it passes (1: as planned), `growth` [1/s] how that changes."""

    def __init__(self, reference: Reference) -> None:
        """Raises `MmpError` for a plan that is not retimed, or has been so without a reserve."""
        if not reference.is_smooth:
            raise MmpError(
                "a monitor needs a plan that has velocities and accelerations at equal steps of time; retime it first"
            )
        pieces = reference.pieces()
        self._growths, self._jerks = _room(pieces, reference.max_acceleration, reference.max_jerk)
        self._ends = pieces.start_s + pieces.step_s * np.arange(1, len(self._growths) + 1)
        if not _longest_stop_s(self._growths, self._jerks) <= LONGEST_STOP_S:
            raise MmpError(
                f"the plan is at its limits, so it cannot be brought to rest within {LONGEST_STOP_S:g} s; retime it "
                "with a share below 1"
            )
        self._last_s, self._end_s = float(reference.times[-1]), reference.end_s
        self.phase, self.speed, self.growth = reference.start_s, 1.0, 0.0
        self._target, self._jerk = 1.0, 0.0
        self._under_way: list[tuple[float, float]] = []  # (how long [s], s'' [1/s^2]), the next one first

    @property
    def at_rest(self) -> bool:
        return self.speed == 0.0

    @property
    def plan_s(self) -> float:
        """The phase, within the times of the plan [s]."""
        return min(max(self.phase, 0.0), self._last_s)

    @property
    def over(self) -> bool:
        """Whether the plan has come to its end."""
        return self.phase >= self._end_s - _TINY

    def turn(self, target: float) -> None:
        """From now on to the speed `target`, 0 or 1, as fast as joints' limits allow all the way there."""
        if target == self._target:
            return
        self._target = target
        easing = -math.copysign(self._jerk, self.growth)
        self._under_way = [(abs(self.growth) / self._jerk, easing)] if self.growth else []

    def advance(self, step_s: float) -> None:
        """Lets time pass [s]."""
        while step_s > 0:
            if not self._under_way:
                if self.speed == self._target:
                    self._pass(step_s, 0.0)
                    return
                self._under_way = self._ramp_to_target()
            lasting, jerk = self._under_way.pop(0)
            passed = min(lasting, step_s)
            self._pass(passed, jerk)
            step_s -= passed
            if passed < lasting:
                self._under_way.insert(0, (lasting - passed, jerk))
            elif not self._under_way:
                self.growth = 0.0
                if abs(self.speed - self._target) < _SAME:
                    self.speed = self._target

    def _pass(self, lasting_s: float, jerk: float) -> None:
        t, v, a = lasting_s, self.speed, self.growth
        forward = t * (v + t * (a / 2 + t * jerk / 6))
        # Rounding must not send the phase back.
        self.phase = min(self.phase + max(forward, 0.0), self._end_s)
        self.speed, self.growth = min(max(v + t * (a + t * jerk / 2), 0.0), 1.0), a + t * jerk

    def _ramp_to_target(self) -> list[tuple[float, float]]:
        """The ramp from here, with the bounds of no more pieces than it can come to."""
        here = min(int(np.searchsorted(self._ends, self.phase, side="right")), len(self._ends) - 1)
        change = self._target - self.speed
        growths, jerks = (np.minimum.accumulate(bounds[here:]) for bounds in (self._growths, self._jerks))
        begin, even = _ramp(abs(change), growths, jerks)
        # As if all of it were passed at the higher speed: then who turns round keeps to these pieces too.
        farthest = self.phase + max(self._target, self.speed) * (2 * begin + even)
        fits = farthest <= self._ends[here:]
        k = int(np.argmax(fits)) if fits.any() else len(fits) - 1
        self._jerk = float(jerks[k])
        outer, inner = float(begin[k]), float(even[k])
        return [(outer, math.copysign(self._jerk, change)), (inner, 0.0), (outer, -math.copysign(self._jerk, change))]


def _ramp(
    change: float, growth: Float[np.ndarray, "p"], jerk: Float[np.ndarray, "p"]
) -> tuple[Float[np.ndarray, "p"], Float[np.ndarray, "p"]]:
    """How long |s'| grows, and as long shrinks in the end, and how long it stays [s] while s changes by `change` with
    |s'| up to `growth` and |s''| up to `jerk`.
    """
    top = np.minimum(growth, np.sqrt(change * jerk))
    return top / jerk, np.maximum(change / top - top / jerk, 0.0)


def _longest_stop_s(growths: Float[np.ndarray, "p"], jerks: Float[np.ndarray, "p"]) -> float:
    """With the least of both; infinite where there is nothing left."""
    if not min(growths.min(), jerks.min()) > 0:
        return math.inf
    begin, even = _ramp(1.0, growths.min(keepdims=True), jerks.min(keepdims=True))
    return float(2 * begin[0] + even[0])


def _room(
    pieces: Pieces, max_acceleration: Float[np.ndarray, "n"], max_jerk: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "p"], Float[np.ndarray, "p"]]:
    """G [1/s] and J [1/s^2]: bounds on |s'| and |s''| in each piece for s from 0 to 1; nothing or less at a limit."""
    rate, curve = np.maximum(pieces.rate, _TINY), np.maximum(pieces.growth, _TINY)
    left = max_jerk - pieces.jerk
    # Half of what jerk has left is for the middle term, the other half for s''.
    growth = np.minimum((max_acceleration - pieces.growth) / rate, left / (6 * curve)).min(axis=1).clip(max=_MOST)
    jerk = ((left - 3 * curve * growth[:, None]) / rate).min(axis=1).clip(max=_MOST**2)
    return growth, jerk
