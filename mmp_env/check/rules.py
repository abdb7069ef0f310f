"""The rules that need no geometry: numbers, times, ends, limits, speed and its derivatives."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedPlan
from mmp_env.check.report import Violation

END_TOLERANCE, LIMIT_TOLERANCE = 1e-6, 1e-9
"""Tolerances [rad or m] of start and goal, and of joint limits."""
SPEED_TOLERANCE = 1e-9
"""Relative tolerance of velocities, for the rounding of a file's decimals."""
MOST_TURN_RAD = 10_000.0
"""Longest motion that is proved [rad or m]: the largest move of a joint in each step, summed up. It takes hours."""


def finite(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields violations by numbers that are not finite. The other rules need finite numbers."""
    for what, values in (("times", plan.times), ("start", plan.start), ("goal", plan.goal)):
        if not np.isfinite(values).all():
            yield Violation(rule="finite", message=f"{what} holds {values[~np.isfinite(values)][0]}")
    for what in ("positions", "velocities", "accelerations"):
        values = getattr(plan, what)
        if values is not None and not np.isfinite(values).all():
            row, column = np.argwhere(~np.isfinite(values))[0]
            arm, joint = plan.joints[column]
            message = f"{what} of arm '{arm}', joint {joint}, sample {row}, is {values[row, column]}"
            yield Violation(rule="finite", message=message, arms=(arm,))


def times(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields violations by times that do not start at 0 or do not ascend."""
    if plan.times[0] != 0.0:
        yield Violation(
            rule="times", message=f"the first time is {plan.times[0]} s; it must be 0", time_s=plan.times[0]
        )
    late = np.flatnonzero(np.diff(plan.times) <= 0)
    if len(late):
        k = int(late[0])
        message = f"time {plan.times[k + 1]} s of sample {k + 1} does not come after {plan.times[k]} s"
        yield Violation(rule="times", message=message, time_s=float(plan.times[k + 1]), values={"samples": len(late)})


def length(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields a violation by a motion that is too long for a proof."""
    turn = float(np.abs(np.diff(plan.positions, axis=0)).max(axis=1).sum())
    if turn > MOST_TURN_RAD:
        message = f"not proved: joints turn by {turn:.6g} rad one after another; allowed: {MOST_TURN_RAD:g} in one plan"
        yield Violation(rule="length", message=message, values={"turn_rad": turn, "allowed_rad": MOST_TURN_RAD})


def ends(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields violations by first and last configurations that are not start and goal of the problem."""
    units = plan.units
    for rule, given, row in (("start", plan.start, 0), ("goal", plan.goal, -1)):
        off = np.abs(plan.positions[row] - given)
        for column in np.flatnonzero(off > END_TOLERANCE):
            arm, joint = plan.joints[column]
            yield Violation(
                rule=rule,
                message=f"arm '{arm}', joint {joint}, is {off[column]:.3g} {units[column]} away from the {rule}",
                time_s=float(plan.times[row]),
                arms=(arm,),
                values={"joint": joint, f"off_{units[column]}": float(off[column])},
            )


def beyond_limits(plan: CheckedPlan) -> Float[np.ndarray, "t n"]:
    """Returns how far each joint is beyond its robot's limits [rad or m]; negative within."""
    return np.maximum(plan.of_robots("lower") - plan.positions, plan.positions - plan.of_robots("upper"))


def limits(plan: CheckedPlan) -> Iterator[Violation]:
    """Joints stay within the robot's limits; a straight line between two samples inside is inside."""
    lower, upper, beyond = plan.of_robots("lower"), plan.of_robots("upper"), beyond_limits(plan)
    for column in np.flatnonzero(beyond.max(axis=0) > LIMIT_TOLERANCE):
        row = int(np.argmax(beyond[:, column]))
        arm, joint = plan.joints[column]
        unit = plan.units[column]
        at, low, high = float(plan.positions[row, column]), float(lower[column]), float(upper[column])
        yield Violation(
            rule="limits",
            message=f"arm '{arm}', joint {joint}, is at {at:.10g} {unit}; allowed: {low:.10g} to {high:.10g}",
            time_s=float(plan.times[row]),
            arms=(arm,),
            values={"joint": joint, f"position_{unit}": at, f"lower_{unit}": low, f"upper_{unit}": high},
        )


def speed(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields violations by joints with |dq| / dt above the limits of the problem or of the robot."""
    allowed = np.minimum(plan.max_velocity, plan.of_robots("velocity"))
    step = np.diff(plan.times)
    forward = step > 0  # the rule `times` reports the others
    rate = np.diff(plan.positions, axis=0)[forward] / step[forward, None]
    yield from exceeded(plan, "speed", "moves at", "/s", rate, allowed, plan.times[:-1][forward], SPEED_TOLERANCE)


def exceeded(
    plan: CheckedPlan,
    rule: str,
    does: str,
    per: str,
    rate: Float[np.ndarray, "m n"],
    allowed: Float[np.ndarray, "*m n"],
    at: Float[np.ndarray, "m"],
    tolerance: float,
) -> Iterator[Violation]:
    """Yields a violation for every joint whose |rate| is above the limit (at all times, or at each), at the worst.

    `per` is the unit of the rates after that of the joint, such as `/s`.
    """
    allowed = np.broadcast_to(allowed, rate.shape)
    excess = np.abs(rate) - allowed * (1 + tolerance)
    for column in np.flatnonzero(~(excess.max(axis=0, initial=-np.inf) <= 0)):
        row = int(np.argmax(excess[:, column]))
        arm, joint = plan.joints[column]
        value, limit, unit = float(abs(rate[row, column])), float(allowed[row, column]), plan.units[column] + per
        yield Violation(
            rule=rule,
            message=f"arm '{arm}', joint {joint}, {does} {_unlike(value, limit)} {unit}; allowed: {limit:.6g}",
            time_s=float(at[row]),
            arms=(arm,),
            values={"joint": joint, "value": value, "allowed": limit, "unit": unit},
        )


def _unlike(value: float, limit: float) -> str:
    """Returns a value with enough digits to differ from the limit."""
    return next((text for digits in (6, 9, 12) if (text := f"{value:.{digits}g}") != f"{limit:.{digits}g}"), str(value))
