"""The clock of a path: the speed of its phase, from rest to rest. Ruckig times every zone.

The clock has no acceleration at the bounds of zones, so neighbouring zones only agree on a speed. A backward pass
limits these speeds to those that can still be braked, a forward pass to those that can be reached, with the distance of
a change of speed in closed form. Then each zone is a problem of one joint for Ruckig: from speed to speed over its
length. A zone between two stops that is too short for Ruckig has a profile in closed form.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import ruckig
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.retime.zones import LEAST_ZONE_S, Zones

MOST_SAMPLES = 1_000_000
"""Largest number of samples of a motion."""
_SLACK = 1e-6
"""Share of the length of a zone that is kept free for rounding."""
_TINY = 1e-60
"""Smallest linear coefficient of the cubic equation of a ramp."""
_EARLY = 1e-9
"""Distance [samples] within which a time is that of a sample."""
LEAST_LENGTH_S = 1e-20
"""Shortest motion [s of phase] that takes time; the positions do not resolve it."""
_EXACT_S = 1e-14
"""Distance [s of phase] by which a profile may miss the end of its zone, for rounding."""
_TIMED = (ruckig.Result.Working, ruckig.Result.Finished)


@dataclass(frozen=True, kw_only=True, eq=False)
class PathTiming:
    """`phase` [t] [s], its `speed` [t] and acceleration `growth` [t] [1/s] at times that are `period_s` apart."""

    period_s: float
    phase: Float[np.ndarray, "t"]
    speed: Float[np.ndarray, "t"]
    growth: Float[np.ndarray, "t"]

    @property
    def duration_s(self) -> float:
        return (len(self.phase) - 1) * self.period_s


def run_clock(zones: Zones, period_s: float) -> PathTiming:
    """Returns the clock through all zones. It waits at a stop until the next sample.

    Raises `MmpError` if the motion has more than `MOST_SAMPLES` samples.
    """
    speeds, timer = speeds_at_bounds(zones), _Timer()
    pieces: list[tuple[float, float, float, float, float]] = []
    begin = 0.0  # time [s] at which the zone begins
    for k, (base, last) in enumerate(itertools.pairwise(zones.bounds.tolist())):
        limits = speed, *_ = float(zones.speed[k]), float(zones.growth[k]), float(zones.jerk[k])
        if last - base < LEAST_ZONE_S and zones.stop[k] and zones.stop[k + 1]:
            begin = _time_short_zone(begin, base, last, limits, pieces)
        elif speeds[k] == speeds[k + 1] == speed:
            pieces.append((begin, base, speed, 0.0, 0.0))
            begin += (last - base) / speed
        else:
            begin = timer.time(begin, base, last, speeds[k], speeds[k + 1], limits, pieces)
        if zones.stop[k + 1]:
            pieces.append((begin, last, 0.0, 0.0, 0.0))
            begin = math.ceil(begin / period_s - _EARLY) * period_s
    start, phase, speed, growth, jerk = np.array(pieces).T
    check_samples(begin, period_s)
    times = period_s * np.arange(round(begin / period_s) + 1)
    piece = np.searchsorted(start, times + _EARLY * period_s, side="right") - 1
    t, v, a, j = times - start[piece], speed[piece], growth[piece], jerk[piece]
    return PathTiming(
        period_s=period_s,
        phase=phase[piece] + t * (v + t * (a / 2 + t * j / 6)),
        speed=v + t * (a + t * j / 2),
        growth=a + t * j,
    )


def check_samples(duration_s: float, period_s: float) -> None:
    """Raises `MmpError` for a motion of more than `MOST_SAMPLES` samples."""
    if not duration_s <= MOST_SAMPLES * period_s:
        raise MmpError(
            f"the motion would take {duration_s:.3g} s, with more than {MOST_SAMPLES} samples; its limits are too low "
            "for its length and rate"
        )


def rough_duration(zones: Zones) -> float:
    """Returns a rough duration [s] of the clock from the speeds at the bounds of zones."""
    lengths, speeds = np.diff(zones.bounds), np.array(speeds_at_bounds(zones))
    from_rest = np.minimum(zones.speed, np.sqrt(zones.growth * lengths)) / 2
    return float((lengths / np.maximum((speeds[1:] + speeds[:-1]) / 2, from_rest)).sum())


def speeds_at_bounds(zones: Zones) -> list[float]:
    """Returns the largest speeds of the clock at the bounds of zones that both neighbours allow and can reach."""
    lengths = (np.diff(zones.bounds) * (1 - _SLACK)).tolist()
    cap = np.minimum(np.append(zones.speed, 0.0), np.append(0.0, zones.speed))
    speeds = np.where(zones.stop, 0.0, cap).tolist()
    growth, jerk = zones.growth.tolist(), zones.jerk.tolist()
    for k in reversed(range(len(lengths))):
        speeds[k] = _reachable(speeds[k + 1], speeds[k], lengths[k], growth[k], jerk[k])
    for k in range(len(lengths)):
        speeds[k + 1] = _reachable(speeds[k], speeds[k + 1], lengths[k], growth[k], jerk[k])
    return speeds


def _reachable(begin: float, wanted: float, length: float, growth: float, jerk: float) -> float:
    """Returns the highest speed up to `wanted` that can be reached from `begin` within `length`; see `_distance`."""
    if wanted <= begin or _distance(begin, wanted, growth, jerk) <= length:
        return wanted
    ramp = growth / jerk
    if ramp * (2 * begin + growth * ramp) <= length:  # long enough to reach `growth`
        mean, beyond = begin / growth + ramp / 2, length - begin * ramp
        change = 2 * beyond / (mean + math.sqrt(mean**2 + 2 * beyond / growth))
    else:
        change = _root(2 * begin, length * math.sqrt(jerk)) ** 2
    return math.nextafter(begin + change, begin)  # rounding must not enlarge a tiny change


def _root(linear: float, value: float) -> float:
    """Returns the s > 0 with s^3 + linear s = value, for linear >= 0 and value > 0."""
    if linear < _TINY:
        return math.cbrt(value)
    scale = math.sqrt(linear / 3)
    return 2 * scale * math.sinh(math.asinh(value / (2 * scale**3)) / 3)


def _distance(begin: float, end: float, growth: float, jerk: float) -> float:
    """Returns the distance of a symmetric change of speed, without acceleration at its ends: mean speed x duration."""
    change = end - begin
    ramp = growth / jerk
    duration = change / growth + ramp if change >= growth * ramp else 2 * math.sqrt(change / jerk)
    return (begin + end) / 2 * duration


def _time_short_zone(
    begin_s: float,
    base: float,
    last: float,
    limits: tuple[float, float, float],
    pieces: list[tuple[float, float, float, float, float]],
) -> float:
    """Times a zone from rest to rest like `_Timer.time`, in four pieces of equal duration with jerks of j, -j, -j, j.

    If each piece lasts t, the length of the zone is 2 j t^3, the highest growth is j t and the highest speed j t^2.
    """
    length, (most_speed, most_growth, most_jerk) = last - base, limits
    if length <= LEAST_LENGTH_S:
        return begin_s
    step = max(length / (2 * most_speed), math.sqrt(length / (2 * most_growth)), math.cbrt(length / (2 * most_jerk)))
    speed, growth, jerk = length / (2 * step), length / (2 * step**2), length / (2 * step**3)
    starts = (
        (base, 0.0, 0.0, jerk),
        (base + length / 12, speed / 2, growth, -jerk),
        (base + length / 2, speed, 0.0, -jerk),
        (last - length / 12, speed / 2, -growth, jerk),
    )
    for start in starts:
        pieces.append((begin_s, *start))
        begin_s += step
    return begin_s


class _Timer:
    """Ruckig for one joint, the phase. It keeps Ruckig's objects, which take longer to make than to use."""

    def __init__(self) -> None:
        self._ruckig, self._given, self._trajectory = ruckig.Ruckig(1), ruckig.InputParameter(1), ruckig.Trajectory(1)
        self._given.min_velocity = [0.0]

    def time(
        self,
        begin_s: float,
        base: float,
        last: float,
        speed: float,
        end_speed: float,
        limits: tuple[float, float, float],
        pieces: list[tuple[float, float, float, float, float]],
    ) -> float:
        """Times a zone that begins at `begin_s`, and returns its end [s].

        Adds its `pieces` of constant jerk: when each begins [s], and phase, speed, growth and jerk there.
        """
        given = self._given
        given.current_position, given.target_position = [base], [last]
        given.current_velocity, given.target_velocity = [speed], [end_speed]
        given.max_velocity, given.max_acceleration, given.max_jerk = ([limit] for limit in limits)
        try:
            result = self._ruckig.calculate(given, self._trajectory)
        except ruckig.RuckigError as error:  # the numbers are too small for Ruckig
            raise MmpError(
                "the acceleration and jerk limits are too low: the motion would take longer than can be computed"
            ) from error
        profile = self._trajectory.profiles[0][0] if result in _TIMED else None
        if profile is None or profile.brake.duration > 0:
            raise RuntimeError(f"Ruckig finds no profile from {speed} to {end_speed} in {last - base} s: {result}")
        parts = [
            part for part in zip(profile.t, profile.p, profile.v, profile.a, profile.j, strict=False) if part[0] > 0
        ]
        # Ruckig accepts a profile that ends up to 1e-8 s before the target: a jump that is visible at high rates.
        rest, fastest = last - profile.p[-1], max(speed, end_speed)
        if rest > _EXACT_S and fastest > 0:
            if speed > end_speed:
                later = [(duration, phase + rest, *rates) for duration, phase, *rates in parts]
                parts = [(rest / speed, base, speed, 0.0, 0.0), *later]
            else:
                parts.append((rest / end_speed, last - rest, end_speed, 0.0, 0.0))
        for duration, *state in parts:
            pieces.append((begin_s, *state))
            begin_s += duration
        return begin_s
