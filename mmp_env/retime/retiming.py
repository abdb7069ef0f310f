"""Retiming: smooths the path of a plan, times it within acceleration and jerk limits, and proves the result."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import known_keywords
from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_fit, given_plan
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.clock import check_samples
from mmp_env.retime.course import course_of
from mmp_env.retime.limits import JointLimits, rate_limits, split
from mmp_env.retime.options import RetimeOptions
from mmp_env.retime.pace import paced_path
from mmp_env.retime.proof import ProvedMotion, proved_motion, unproved_motion
from mmp_env.retime.smoothing import deviation
from mmp_env.retime.steps import Steps, finished

_INWARD = 0.99
"""Share of the tolerance that the smoothed path may use; the rest is for rounding."""


@dataclass(frozen=True, kw_only=True)
class RetimeReport:
    """The result of retiming a plan: makespans and deviation.

    Attributes:
        given_s: makespan [s] of the plan before.
        fastest_s: makespan [s] on the corners of the plan at its velocity limits; no motion on its path is shorter.
        smoothed_s: makespan [s] on the smoothed path at the velocity limits.
        makespan_s: makespan [s] of the result.
        tolerance_rad: distance [rad] from the path of the plan that was allowed.
        deviation_rad: largest distance [rad] of a joint from the path of the plan.
        corners: number of corners of the plan.
        stops: number of corners that are not rounded.
        clearance_m: clearance [m] proved of the result at every instant.
        seconds: wall-clock time [s] of retiming.
    """

    given_s: float
    fastest_s: float
    smoothed_s: float
    makespan_s: float
    tolerance_rad: float
    deviation_rad: float
    corners: int
    stops: int
    clearance_m: float
    seconds: float

    @property
    def ratio(self) -> float:
        """Makespan of the result relative to `fastest_s`."""
        return self.makespan_s / self.fastest_s if self.fastest_s > 0 else 1.0


@known_keywords
def retime(
    plan: Plan | None,
    *,
    rate: float = RetimeOptions.rate,
    tolerance: float = RetimeOptions.tolerance,
    share: float = RetimeOptions.share,
    max_acceleration: JointLimits = None,
    max_jerk: JointLimits = None,
) -> Plan:
    """Rounds the corners of a plan, and times it within velocity, acceleration and jerk limits.

    The result starts and ends at rest, and is proved free of conflicts at every instant. All arms share one clock, so
    they pass each other exactly as planned. docs/how-to/retime.md describes the method.

    Args:
        plan: a plan that is not retimed.
        rate: samples per second [Hz], from 20 to 100,000.
        tolerance: largest distance of a joint from the path of the plan [rad].
        share: share of the acceleration and jerk limits that the motion uses, above 0. The rest is left for a monitor
            that slows the motion down.
        max_acceleration: [rad/s^2], a number for all joints, or arm name -> a number or [dof]; None for the robots'
            own limits.
        max_jerk: [rad/s^3], like `max_acceleration`.

    Returns:
        The plan with new `times`, `positions`, `velocities`, `accelerations` and their limits.

    Raises:
        MmpError: for a wrong value, a plan that is retimed already, a plan that cannot be proved, or None, which a
            planner returns if it finds no plan.
    """
    return retime_with_report(
        plan, rate=rate, tolerance=tolerance, share=share, max_acceleration=max_acceleration, max_jerk=max_jerk
    )[0]


@known_keywords
def retime_with_report(
    plan: Plan | None,
    *,
    rate: float = RetimeOptions.rate,
    tolerance: float = RetimeOptions.tolerance,
    share: float = RetimeOptions.share,
    max_acceleration: JointLimits = None,
    max_jerk: JointLimits = None,
) -> tuple[Plan, RetimeReport]:
    """Retimes a plan like `retime`, with the same arguments and errors, and returns a report as well."""
    began = time.perf_counter()
    options = RetimeOptions(
        rate=rate, tolerance=tolerance, share=share, max_acceleration=max_acceleration, max_jerk=max_jerk
    )
    plan = _checked(given_plan(plan, "retime"), options.rate)
    full = rate_limits(plan.problem, options.max_acceleration, options.max_jerk)
    limits = full.reduced(options.share)
    check_samples(course_of(plan, limits.velocity).end, 1.0 / options.rate)
    inside = _INWARD * options.tolerance
    done = proved_motion(plan, finished(paced_path(plan, limits, inside)), limits, inside, 1.0 / options.rate)
    report = _report(plan, done, limits.velocity, options.tolerance, began)
    stats = {key: value for key, value in dataclasses.asdict(report).items() if key != "seconds"}
    cell = plan.problem.cell
    return dataclasses.replace(
        done.motion,
        max_acceleration=split(cell, full.acceleration),
        max_jerk=split(cell, full.jerk),
        stats={**plan.stats, "retimed": stats},
    ), report


def retime_unproved(plan: Plan, options: RetimeOptions) -> Steps[Plan]:
    """Returns, in steps, the motion that `retime` would prove first, for callers that prove it part by part.

    Raises `MmpError` like `retime`, but not for a plan that cannot be proved.
    """
    plan = _checked(plan, options.rate)
    full = rate_limits(plan.problem, options.max_acceleration, options.max_jerk)
    limits, period_s = full.reduced(options.share), 1.0 / options.rate
    check_samples(course_of(plan, limits.velocity).end, period_s)
    yield
    path = yield from paced_path(plan, limits, _INWARD * options.tolerance)
    yield
    motion = yield from unproved_motion(plan, path, limits, period_s)
    cell = plan.problem.cell
    return dataclasses.replace(
        motion,
        max_acceleration=split(cell, full.acceleration),
        max_jerk=split(cell, full.jerk),
    )


def _checked(plan: Plan, rate: float) -> Plan:
    """Returns the plan; one whose arms never move gets a second sample. Raises `MmpError` if it cannot be retimed."""
    check_fit(plan, plan.problem.cell)
    plan.check_complete()
    if plan.accelerations is not None:
        raise MmpError("the plan is retimed already; retime the one that it was made from")
    if len(plan.times) > 1:
        return plan
    times = plan.times[0] + np.array([0.0, 1.0 / rate])
    return dataclasses.replace(plan, times=times, positions={name: q[[0, 0]] for name, q in plan.positions.items()})


def _report(
    plan: Plan, done: ProvedMotion, velocity: Float[np.ndarray, "n"], tolerance: float, began: float
) -> RetimeReport:
    path = done.path
    look = np.interp(np.arange(0.0, len(path.breaks) - 0.5, 0.5), np.arange(len(path.breaks)), path.breaks)
    return RetimeReport(
        given_s=plan.makespan_s,
        fastest_s=course_of(plan, velocity).end,
        smoothed_s=_fastest(path, velocity),
        makespan_s=done.motion.makespan_s,
        tolerance_rad=tolerance,
        deviation_rad=float(deviation(path, look).max()),
        corners=len(path.corners),
        stops=len(path.stops),
        clearance_m=done.clearance_m,
        seconds=time.perf_counter() - began,
    )


def _fastest(path: BlendedPath, velocity: Float[np.ndarray, "n"]) -> float:
    """Returns the duration [s] of the path at its velocity limits, by Gauss's two-point rule on each polynomial."""
    middle, half = (path.breaks[1:] + path.breaks[:-1]) / 2, np.diff(path.breaks) / 2
    slope = path.derivatives(np.concatenate([middle - half / np.sqrt(3), middle + half / np.sqrt(3)]), (1,))[0]
    return float((np.abs(slope) / velocity).max(axis=1) @ np.tile(half, 2))
