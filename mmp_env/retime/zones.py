"""Limits of the clock in each zone of a path: speed, acceleration and jerk of the phase.

With q(u) and the clock u(t), a joint has velocity q'u', acceleration q''u'^2 + q'u'' and jerk q'''u'^3 + 3q''u'u'' +
q'u'''. In each zone the largest |q'|, |q''| and |q'''| of each joint give bounds C, A and J on u', u'' and u''' that
keep every joint within its limits whatever the clock does within them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.limits import RateLimits
from mmp_env.retime.steps import Steps

CURVE_SHARE = 0.8
"""Share of the acceleration that a curve may use; the rest is for changes of speed."""
CURVE_JERK, CROSS_JERK = 0.4, 0.2
"""Shares of the jerk for a changing curve, and for changes of speed in a curve; the rest is for the clock's jerk."""
ZONE_S = 0.04
"""Length of a zone [s of phase]; longer for low jerk limits, where a change of acceleration takes longer."""
_ZONE_RAMPS, _MOST_ZONES = 6.0, 5_000
"""Least length of a zone in changes of acceleration; largest number of zones."""
_TINY, _FASTEST = 1e-9, 1e3
"""Least derivative, and largest limits of the clock."""
_SLOW = 0.95
"""Speed of a blend below which it is a zone of its own."""
LEAST_ZONE_S = 1e-5
"""Shortest zone [s of phase] that is not between two stops; Ruckig resolves 1e-8 s."""
_SAFETY = 1 - 1e-6
"""Share of the limits that the zones use, for rounding."""
_ROUNDING_S = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class Zones:
    """Zones between `bounds` [z + 1] (phases [s]) and the limits of the clock in them.

    The limits are `speed` [z], acceleration `growth` [z] [1/s] and `jerk` [z] [1/s^2]. The clock stands still where
    `stop` [z + 1] is true, as at both ends.
    """

    bounds: Float[np.ndarray, "b"]
    speed: Float[np.ndarray, "z"]
    growth: Float[np.ndarray, "z"]
    jerk: Float[np.ndarray, "z"]
    stop: np.ndarray


def zones_of(path: BlendedPath, limits: RateLimits) -> Steps[Zones]:
    """Returns, in steps, zones of about equal length, which end at stops."""
    ramp_s = np.minimum(limits.acceleration / limits.jerk, np.sqrt(limits.velocity / limits.jerk)).max()
    length_s = max(ZONE_S, _ZONE_RAMPS * float(ramp_s), path.course.end / _MOST_ZONES)
    bounds, marks = _bounds(path, limits, length_s)
    yield
    first, second, third = yield from _largest(path, bounds)
    yield
    v, a, j = limits.velocity * _SAFETY, limits.acceleration * _SAFETY, limits.jerk * _SAFETY
    first, second, third = (np.maximum(part, _TINY) for part in (first, second, third))
    speed = np.minimum.reduce([v / first, np.sqrt(CURVE_SHARE * a / second), np.cbrt(CURVE_JERK * j / third)])
    speed = speed.min(axis=1, keepdims=True).clip(max=_FASTEST)
    growth = np.minimum((a - second * speed**2) / first, CROSS_JERK * j / (3 * second * speed))
    growth = growth.min(axis=1, keepdims=True).clip(max=_FASTEST)
    yield
    jerk = ((j - third * speed**3 - 3 * second * speed * growth) / first).min(axis=1).clip(max=_FASTEST**2)
    return Zones(bounds=bounds, speed=speed[:, 0], growth=growth[:, 0], jerk=jerk, stop=np.isin(bounds, marks))


def _bounds(
    path: BlendedPath, limits: RateLimits, length_s: float
) -> tuple[Float[np.ndarray, "b"], Float[np.ndarray, "m"]]:
    """Returns the bounds of zones, and those of them that are stops. A slow blend is a zone of its own.

    Every stop is a bound, however close to another one it is: the clock must start at 0, and stand still at each stop.
    """
    marks = np.unique(np.concatenate([[0.0], path.stops, [path.course.end]]))
    slow = path.speeds(limits, CURVE_SHARE, CURVE_JERK) < _SLOW
    ends = np.concatenate([(path.corners - path.reach)[slow], (path.corners + path.reach)[slow]])
    fixed, stops = [float(marks[0])], set(marks.tolist())
    for phase in np.unique(np.concatenate([ends.clip(0.0, path.course.end), marks])).tolist()[1:]:
        if phase > fixed[-1] + LEAST_ZONE_S or (phase in stops and fixed[-1] in stops):
            fixed.append(phase)
        elif phase in stops:
            fixed[-1] = phase
    count = np.maximum(1, np.round(np.diff(fixed) / length_s)).astype(int)
    return np.interp(np.arange(count.sum() + 1), np.append(0, np.cumsum(count)), fixed), marks


def _largest(path: BlendedPath, bounds: Float[np.ndarray, "b"]) -> Steps[list[Float[np.ndarray, "z n"]]]:
    """Returns the largest |q'|, |q''|, |q'''| in each zone.

    Between breaks q'' is linear and q''' constant, so their values at breaks suffice.
    """
    # A stop has two slopes; the one just before it belongs to the zone before.
    before = np.nextafter(path.stops, 0.0)
    phase = np.unique(np.concatenate([path.breaks, bounds, before]))
    slope, curve, third = path.derivatives(phase, (1, 2, 3))
    yield
    long = np.diff(phase, append=-np.inf) > _ROUNDING_S
    third[~long], long = 0.0, np.flatnonzero(long)
    # If q'' changes its sign between two of these, q' is largest in between.
    turned = long[(curve[long] * curve[long + 1] < 0).any(axis=1)]
    peak = np.abs(slope)
    over = np.abs(slope[turned] - curve[turned] ** 2 / np.where(third[turned] == 0, np.inf, 2 * third[turned]))
    peak[turned] = np.maximum(peak[turned], np.where(curve[turned] * curve[turned + 1] < 0, over, 0.0))
    yield
    starts, ends = np.searchsorted(phase, bounds[:-1]), np.searchsorted(phase, bounds[1:])
    smooth = ~np.isin(bounds[1:], path.stops)
    out = []
    for values, shared in ((peak, True), (np.abs(curve), True), (np.abs(third), False)):
        out.append(np.maximum.reduceat(values, starts, axis=0))
        if shared:  # the end of a zone belongs to it too
            out[-1][smooth] = np.maximum(out[-1][smooth], values[ends[smooth]])
        yield
    return out
