"""The pace for which blends are made: full speed where velocities are what limits a motion, else what suits its lines.

A blend is as wide as passing its corner at the pace needs. Made for a pace that accelerations never let the motion
come to, blends are in each other's way; made for too slow a one, they hold the motion up. So a few paces are looked at,
each in a quick way first, and only what promises most is looked at closely.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from mmp_env.model.plan import Plan
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.clock import rough_duration
from mmp_env.retime.course import Course, course_of
from mmp_env.retime.limits import RateLimits
from mmp_env.retime.smoothing import first_blends, fitted, smooth
from mmp_env.retime.zones import zones_of

GOOD = 1.25
"""A duration, in those that velocities alone allow, at which no other pace is looked at."""
_FAST, _BETWEEN, _MEDIUM, _SLOW = 3.3, 2.2, 1.5, 0.7
"""In natural paces, see `_natural_pace`. Lines of one length like the first ones, mixed ones the last; a finer choice
gains 1 % on average and 5 % at most.
"""
_LEAST_PACE = 1e-4
"""Slower ones would make much of motions by next to nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    path: BlendedPath
    duration_s: float
    is_smooth: bool


def paced_path(plan: Plan, limits: RateLimits, tolerance: float) -> BlendedPath:
    """The smoothed path of a plan, within `tolerance` [rad], that of the paces looked at is passed soonest.

    Whether it is clear of obstacles and other arms has been looked at only where there was a choice.
    """
    candidates = _candidates(plan, limits, tolerance)
    if len(candidates) == 1:
        return candidates[0].path
    # Obstacles and other arms only ever make it longer, so what is best after a close look needs no other one.
    while not (best := min(candidates, key=lambda one: one.duration_s)).is_smooth:
        path = smooth(plan.problem, best.path, tolerance)
        candidates.remove(best)
        candidates.append(_Candidate(path=path, duration_s=_duration(path, limits), is_smooth=True))
    return best.path


def _candidates(plan: Plan, limits: RateLimits, tolerance: float) -> list[_Candidate]:
    """Paths for a few paces, without a look at obstacles and other arms."""
    course = course_of(plan, limits.velocity)
    natural = _natural_pace(course, limits)

    @functools.cache
    def at(pace: float) -> _Candidate:
        at_pace = course if pace == 1.0 else course_of(plan, pace * limits.velocity)
        path = fitted(plan.problem.cell, first_blends(at_pace, limits, tolerance), tolerance)
        return _Candidate(path=path, duration_s=_duration(path, limits), is_smooth=False)

    fast, medium, between, slow = (min(1.0, factor * natural) for factor in (_FAST, _MEDIUM, _BETWEEN, _SLOW))
    if at(fast).duration_s <= GOOD * course.end:
        return [at(fast)]
    third = slow if at(medium).duration_s <= at(fast).duration_s else between
    return [at(pace) for pace in dict.fromkeys((fast, medium, third))]


def _natural_pace(course: Course, limits: RateLimits) -> float:
    """The speed of the phase, a mean over the course, to which its lines can be brought within their own lengths."""
    lengths, slope = np.diff(course.knots), np.maximum(np.abs(course.slopes), 1e-12)
    growth, jerk = ((most / slope).min(axis=1) for most in (limits.acceleration, limits.jerk))
    speeds = np.minimum(np.sqrt(growth * lengths), np.cbrt(jerk * lengths**2))
    return max(float(speeds @ lengths / max(course.end, 1e-12)), _LEAST_PACE)


def _duration(path: BlendedPath, limits: RateLimits) -> float:
    return rough_duration(zones_of(path, limits))
