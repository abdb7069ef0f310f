"""A plan that controllers accept, made of one that only knows velocities: smoothed, timed, proved."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_fit, given_plan
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.clock import check_samples
from mmp_env.retime.course import course_of
from mmp_env.retime.limits import rate_limits, split
from mmp_env.retime.options import RetimeOptions
from mmp_env.retime.pace import paced_path
from mmp_env.retime.proof import ProvedMotion, proved_motion
from mmp_env.retime.report import RetimeReport
from mmp_env.retime.smoothing import deviation

_INWARD = 0.99


def retime(plan: Plan | None, **options: Any) -> Plan:
    """The plan with corners rounded and a clock that keeps every joint's velocity, acceleration and jerk limits.

    It starts and ends at rest and is proved conflict free at every instant, like the plan. All arms share the clock, so
    nobody is late for anybody. Limits are the problem's velocities and the robots' accelerations and jerks, or those
    given. `options` are the fields of `RetimeOptions`: `rate`, `tolerance`, `share`, `max_acceleration`, `max_jerk`.

    Raises `MmpError` for wrong values, a plan that is retimed already, one that cannot be proved itself, and None,
    which is what a planner has that found no plan.
    """
    return retime_with_report(plan, **options)[0]


def retime_with_report(plan: Plan | None, **options: Any) -> tuple[Plan, RetimeReport]:
    """As `retime`, and what became of the plan."""
    began = time.perf_counter()
    chosen = RetimeOptions.of(options)
    plan = given_plan(plan, "retime")
    _check(plan)
    full = rate_limits(plan.problem, chosen.max_acceleration, chosen.max_jerk)
    limits = full.reduced(chosen.share)
    check_samples(course_of(plan, limits.velocity).end, 1.0 / chosen.rate)
    tolerance = _INWARD * chosen.tolerance
    done = proved_motion(plan, paced_path(plan, limits, tolerance), limits, tolerance, 1.0 / chosen.rate)
    report = _report(plan, done, limits.velocity, chosen.tolerance, began)
    told = {key: value for key, value in dataclasses.asdict(report).items() if key != "seconds"}
    cell = plan.problem.cell
    return dataclasses.replace(
        done.motion,
        max_acceleration=split(cell, full.acceleration),
        max_jerk=split(cell, full.jerk),
        stats={**plan.stats, "retimed": told},
    ), report


def _check(plan: Plan) -> None:
    if len(plan.times) < 2:
        raise MmpError("the plan has one sample; to be retimed it needs its start and its goal at least")
    check_fit(plan, plan.problem.cell)
    plan.check_complete()
    if plan.accelerations is not None:
        raise MmpError("the plan is retimed already; retime the one that it was made from")


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
    """How long the path takes at its velocity limits [s], by Gauss's rule of two points for each polynomial."""
    middle, half = (path.breaks[1:] + path.breaks[:-1]) / 2, np.diff(path.breaks) / 2
    slope = path.derivatives(np.concatenate([middle - half / np.sqrt(3), middle + half / np.sqrt(3)]), (1,))[0]
    return float((np.abs(slope) / velocity).max(axis=1) @ np.tile(half, 2))
