"""The pace of blends: the share of full speed at which the corners of a path are to be passed.

A blend is as wide as its corner needs at the pace. If accelerations never allow the pace, blends are too wide and
overlap; if the pace is too slow, blends slow the motion down. So we estimate a few paces quickly, and measure only the
best one closely.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mmp_env.model.plan import Plan
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.clock import rough_duration
from mmp_env.retime.course import Course, course_of
from mmp_env.retime.limits import RateLimits
from mmp_env.retime.smoothing import first_blends, fitted, smooth
from mmp_env.retime.steps import Steps
from mmp_env.retime.zones import zones_of

GOOD = 1.25
"""Duration, relative to the fastest at velocity limits alone, at which no other pace is tried."""
_FAST, _BETWEEN, _MEDIUM, _SLOW = 3.3, 2.2, 1.5, 0.7
"""Paces that are tried, relative to `_natural_pace`. The first ones suit lines of one length, the last mixed ones. A
finer choice gains 1 % on average and 5 % at most.
"""
_LEAST_PACE = 1e-4
"""Slowest pace."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    path: BlendedPath
    duration_s: float
    is_smooth: bool


def paced_path(plan: Plan, limits: RateLimits, tolerance: float) -> Steps[BlendedPath]:
    """Returns, in steps, the fastest smoothed path of a few paces, within `tolerance` [rad] of the plan.

    Its clearance is tested only if there was a choice of paces; the proof of the result follows.
    """
    candidates = yield from _candidates(plan, limits, tolerance)
    if len(candidates) == 1:
        return candidates[0].path
    # A close test only makes a path slower, so the best tested path is the best of all.
    while not (best := min(candidates, key=lambda one: one.duration_s)).is_smooth:
        path = yield from smooth(plan.problem, best.path, tolerance)
        candidates.remove(best)
        duration_s = yield from _duration(path, limits)
        candidates.append(_Candidate(path=path, duration_s=duration_s, is_smooth=True))
    return best.path


def _candidates(plan: Plan, limits: RateLimits, tolerance: float) -> Steps[list[_Candidate]]:
    """Returns paths for a few paces, without regard to obstacles and other arms."""
    course = course_of(plan, limits.velocity)
    yield
    natural = _natural_pace(course, limits)
    known: dict[float, _Candidate] = {}

    def at(pace: float) -> Steps[_Candidate]:
        if pace not in known:
            at_pace = course if pace == 1.0 else course_of(plan, pace * limits.velocity)
            path = first_blends(at_pace, limits, tolerance)
            yield
            path = yield from fitted(plan.problem.cell, path, tolerance)
            duration_s = yield from _duration(path, limits)
            known[pace] = _Candidate(path=path, duration_s=duration_s, is_smooth=False)
        return known[pace]

    fast, medium, between, slow = (min(1.0, factor * natural) for factor in (_FAST, _MEDIUM, _BETWEEN, _SLOW))
    fastest = yield from at(fast)
    if fastest.duration_s <= GOOD * course.end:
        return [fastest]
    one = yield from at(medium)
    third = yield from at(slow if one.duration_s <= fastest.duration_s else between)
    return list(dict.fromkeys((fastest, one, third)))


def _natural_pace(course: Course, limits: RateLimits) -> float:
    """Returns the mean speed of the phase that the lines of the course can reach within their own lengths."""
    lengths, slope = np.diff(course.phases), np.maximum(np.abs(course.slopes), 1e-12)
    growth, jerk = ((most / slope).min(axis=1) for most in (limits.acceleration, limits.jerk))
    speeds = np.minimum(np.sqrt(growth * lengths), np.cbrt(jerk * lengths**2))
    return max(float(speeds @ lengths / max(course.end, 1e-12)), _LEAST_PACE)


def _duration(path: BlendedPath, limits: RateLimits) -> Steps[float]:
    zones = yield from zones_of(path, limits)
    return rough_duration(zones)
