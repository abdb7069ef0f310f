"""A plan that controllers accept, made of one that only knows velocities: smoothed, timed, proved."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mmp_env import _core
from mmp_env.certificate import certify
from mmp_env.errors import MmpError
from mmp_env.plan import Plan
from mmp_env.plan_fit import check_fit
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.clock import Clock, run_clock
from mmp_env.retime.course import course_of
from mmp_env.retime.limits import Given, RateLimits, rate_limits, split
from mmp_env.retime.report import RetimeReport
from mmp_env.retime.smoothing import covering, deviation, first_blends, narrowed, smooth
from mmp_env.retime.zones import LEAST_ZONE_S, zones_of

DEFAULT_RATE_HZ = 250.0
LEAST_RATE_HZ = 20.0
"""Between samples farther apart, straight as they are, the tolerance would not hold."""
DEFAULT_TOLERANCE_RAD = 0.05
DEFAULT_SHARE = 0.9
ZONE_S = 0.04
"""Phase that is timed as one; longer where jerk limits are so low that a change of acceleration takes as long."""
_ZONE_RAMPS = 6.0
GOOD, _PACE = 1.25, 0.6
"""A makespan, in those that velocities alone allow, that is not worth another try at a slower pace."""
_LONG_S, _LOOK_S, _INWARD = 1e9, 0.02, 0.99
_PROOFS = 12
"""Of the finished motion, each after narrower blends where the last one failed; then it stops at every corner."""


def retime(
    plan: Plan,
    *,
    rate: float = DEFAULT_RATE_HZ,
    tolerance: float = DEFAULT_TOLERANCE_RAD,
    share: float = DEFAULT_SHARE,
    max_acceleration: Given = None,
    max_jerk: Given = None,
) -> Plan:
    """The plan with corners rounded and a clock that keeps every joint's velocity, acceleration and jerk limits.

    It starts and ends at rest, is sampled at `rate` [Hz], 20 at least, and proved conflict free at every instant, like
    the plan. All arms share the clock, so nobody is late for anybody. No joint is farther than `tolerance` [rad] from
    the plan's path. Limits are the problem's velocities and the robots' accelerations and jerks, or those given: a
    number for all joints [rad/s^2], [rad/s^3], or arm -> [dof]. The motion uses a `share` of the last two; the rest is
    for whoever has to slow it down on its way (`mmp_env.monitor`).

    Raises `MmpError` for wrong values, a plan that is retimed already, and one that cannot be proved itself.
    """
    return retime_with_report(
        plan, rate=rate, tolerance=tolerance, share=share, max_acceleration=max_acceleration, max_jerk=max_jerk
    )[0]


def retime_with_report(
    plan: Plan,
    *,
    rate: float = DEFAULT_RATE_HZ,
    tolerance: float = DEFAULT_TOLERANCE_RAD,
    share: float = DEFAULT_SHARE,
    max_acceleration: Given = None,
    max_jerk: Given = None,
) -> tuple[Plan, RetimeReport]:
    """As `retime`, and what became of the plan."""
    began = time.perf_counter()
    _check(plan, rate, tolerance, share)
    full = rate_limits(plan.problem, max_acceleration, max_jerk)
    limits = full.reduced(share)
    fastest = course_of(plan, limits.velocity).end
    done = _best(plan, limits, _INWARD * tolerance, 1.0 / rate, GOOD * fastest)
    look = np.unique(np.concatenate([done.path.breaks(), np.arange(0.0, done.path.course.end, _LOOK_S)]))
    report = RetimeReport(
        given_s=plan.makespan_s,
        fastest_s=fastest,
        smoothed_s=_fastest(done.path, look, limits.velocity),
        makespan_s=done.motion.makespan_s,
        tolerance_rad=tolerance,
        deviation_rad=float(deviation(done.path, look).max()),
        corners=len(done.path.corners),
        stops=len(done.path.stops),
        clearance_m=done.clearance,
        seconds=time.perf_counter() - began,
    )
    told = {key: value for key, value in dataclasses.asdict(report).items() if key != "seconds"}
    cell = plan.problem.cell
    return dataclasses.replace(
        done.motion,
        max_acceleration=split(cell, full.acceleration),
        max_jerk=split(cell, full.jerk),
        stats={**plan.stats, "retimed": told},
    ), report


def _check(plan: Plan, rate: float, tolerance: float, share: float) -> None:
    for what, value, most in (("rate", rate, 1e5), ("tolerance", tolerance, np.pi), ("share", share, 1.0)):
        if not 0 < value <= most:
            raise MmpError(f"{what} is {value}; it must be a positive number, {most:g} at most")
    if rate < LEAST_RATE_HZ:
        raise MmpError(f"rate is {rate:g}; a motion needs at least {LEAST_RATE_HZ:g} samples a second")
    if len(plan.times) < 2:
        raise MmpError("the plan has one sample; to be retimed it needs its start and its goal at least")
    check_fit(plan, plan.problem.cell)
    for name in plan.problem.cell.arm_names:
        if name not in plan.positions:
            raise MmpError(f"the plan has no positions of arm '{name}'; to be proved it needs those of all arms")
    if plan.accelerations is not None:
        raise MmpError("the plan is retimed already; retime the one that it was made from")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Result:
    path: BlendedPath
    clock: Clock
    motion: Plan
    clearance: float


def _best(plan: Plan, limits: RateLimits, tolerance: float, period_s: float, good_s: float) -> _Result:
    """The quickest of several: blends are made for a pace, and where that is too high they are in each other's way."""
    best, pace = None, 1.0
    while True:
        course = course_of(plan, pace * limits.velocity)
        path = smooth(plan.problem, first_blends(course, limits, tolerance), tolerance)
        result = _proved(plan, path, limits, period_s)
        if best is not None and result.motion.makespan_s >= best.motion.makespan_s:
            return best
        if result.motion.makespan_s <= good_s:
            return result
        best, pace = result, pace * _PACE


def _proved(plan: Plan, path: BlendedPath, limits: RateLimits, period_s: float) -> _Result:
    """The motion along the path, with a proof; where that fails, blends become narrower, stops in the end."""
    widest, attempts = path.width, 0
    while True:
        clock = _timed(path, limits, period_s)
        motion, attempts = _sampled(plan, path, clock), attempts + 1
        kept = _bending(path, clock.phase)
        rows = {name: q[kept] for name, q in motion.positions.items()}
        bending = Plan(problem=plan.problem, times=motion.times[kept], positions=rows)
        certificate = certify(bending, _core.Clock(_LONG_S), share=1.0)
        if certificate.valid:
            return _Result(path=path, clock=clock, motion=motion, clearance=certificate.clearance)
        if not (path.width > 0).any():
            raise MmpError("the plan cannot be proved clear of conflicts as it is, so it is not retimed; see mmp check")
        near = covering(path, np.interp([certificate.instant], np.arange(len(kept)), clock.phase[kept]))
        if near.any() and attempts < _PROOFS:
            path = narrowed(path, near, widest)
        else:
            path = path.narrower(np.zeros_like(widest))


def _timed(path: BlendedPath, limits: RateLimits, period_s: float) -> Clock:
    if path.course.end > LEAST_ZONE_S:
        return run_clock(zones_of(path, limits, _zone_length(limits)), period_s)
    still = np.zeros(2)  # where nothing moves, or by nothing to speak of
    return Clock(period_s=period_s, phase=still, speed=still, growth=still)


def _sampled(plan: Plan, path: BlendedPath, clock: Clock) -> Plan:
    cell = plan.problem.cell
    q, slope, curve = path.derivatives(clock.phase, (0, 1, 2))
    q[0], q[-1] = path.course.q[0], path.course.q[-1]
    velocities = slope * clock.speed[:, None]
    accelerations = curve * clock.speed[:, None] ** 2 + slope * clock.growth[:, None]
    return dataclasses.replace(
        plan,
        times=clock.period_s * np.arange(len(q)),
        positions=split(cell, q),
        velocities=split(cell, velocities),
        accelerations=split(cell, accelerations),
    )


def _bending(path: BlendedPath, phase: Float[np.ndarray, "t"]) -> Int[np.ndarray, "k"]:
    """Rows between which the path goes straight, so that the others add nothing: those in blends and next to them."""
    edges = np.zeros(len(phase) + 2, int)
    np.add.at(edges, np.maximum(np.searchsorted(phase, path.corners - path.reach) - 1, 0), 1)
    np.add.at(edges, np.searchsorted(phase, path.corners + path.reach, side="right") + 1, -1)
    kept = np.cumsum(edges)[: len(phase)] > 0
    kept[[0, -1]] = True
    return np.flatnonzero(kept)


def _zone_length(limits: RateLimits) -> float:
    return max(ZONE_S, _ZONE_RAMPS * float((limits.acceleration / limits.jerk).max()))


def _fastest(path: BlendedPath, phase: Float[np.ndarray, "t"], velocity: Float[np.ndarray, "n"]) -> float:
    """How long the path takes at its velocity limits [s]."""
    return float((np.abs(np.diff(path.at(phase), axis=0)) / velocity).max(axis=1).sum())
