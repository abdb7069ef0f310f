"""The rules that need no geometry: numbers, times, ends, limits, speed and its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

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

_JOINTS_AT_ONCE = 32
"""Number of joints whose motion is computed at once; bounds the memory."""
Rates: TypeAlias = tuple[Float[np.ndarray, "m j"], Float[np.ndarray, "*m j"]]
"""Rates of some joints, and what is allowed at all times, or at each."""


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
    turn = float(largest_moves(plan.positions).sum())
    if turn > MOST_TURN_RAD:
        message = f"not proved: joints turn by {turn:.6g} rad one after another; allowed: {MOST_TURN_RAD:g} in one plan"
        yield Violation(rule="length", message=message, values={"turn_rad": turn, "allowed_rad": MOST_TURN_RAD})


def largest_moves(q: Float[np.ndarray, "t n"]) -> Float[np.ndarray, "s"]:
    """Returns the largest move of a joint from each row to the next [rad or m]."""
    out = np.zeros(len(q) - 1)
    for first in range(0, q.shape[1], _JOINTS_AT_ONCE):
        np.maximum(out, np.abs(np.diff(q[:, first : first + _JOINTS_AT_ONCE], axis=0)).max(axis=1), out=out)
    return out


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


def beyond_limits(plan: CheckedPlan) -> Float[np.ndarray, "n"]:
    """Returns how far each joint is beyond its robot's limits at most [rad or m]; negative within."""
    above = plan.positions.max(axis=0) - plan.of_robots("upper")
    return np.maximum(plan.of_robots("lower") - plan.positions.min(axis=0), above)


def limits(plan: CheckedPlan) -> Iterator[Violation]:
    """Joints stay within the robot's limits; a straight line between two samples inside is inside."""
    lower, upper = plan.of_robots("lower"), plan.of_robots("upper")
    for column in np.flatnonzero(beyond_limits(plan) > LIMIT_TOLERANCE):
        q, low, high = plan.positions[:, column], float(lower[column]), float(upper[column])
        row = int(np.argmax(np.maximum(low - q, q - high)))
        arm, joint = plan.joints[column]
        unit = plan.units[column]
        yield Violation(
            rule="limits",
            message=f"arm '{arm}', joint {joint}, is at {q[row]:.10g} {unit}; allowed: {low:.10g} to {high:.10g}",
            time_s=float(plan.times[row]),
            arms=(arm,),
            values={"joint": joint, f"position_{unit}": float(q[row]), f"lower_{unit}": low, f"upper_{unit}": high},
        )


def speed(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields violations by joints with |dq| / dt above the limits of the problem or of the robot."""
    allowed = np.minimum(plan.max_velocity, plan.of_robots("velocity"))
    step = np.diff(plan.times)
    forward = step > 0  # the rule `times` reports the others

    def rates(joints: slice) -> Rates:
        return np.diff(plan.positions[:, joints], axis=0)[forward] / step[forward, None], allowed[joints]

    yield from exceeded(plan, "speed", "moves at", "/s", rates, plan.times[:-1][forward], SPEED_TOLERANCE)


def exceeded(
    plan: CheckedPlan,
    rule: str,
    does: str,
    per: str,
    rates: Callable[[slice], Rates],
    at: Float[np.ndarray, "m"],
    tolerance: float,
) -> Iterator[Violation]:
    """Yields a violation for every joint whose |rate| is above the limit, at the worst time.

    `rates` computes those of a few joints, which bounds the memory. `per` is the unit of the rates after that of the
    joint, such as `/s`.
    """
    for first in range(0, len(plan.joints), _JOINTS_AT_ONCE):
        rate, allowed = rates(slice(first, first + _JOINTS_AT_ONCE))
        allowed = np.broadcast_to(allowed, rate.shape)
        excess = np.abs(rate) - allowed * (1 + tolerance)
        for column in np.flatnonzero(~(excess.max(axis=0, initial=-np.inf) <= 0)):
            row = int(np.argmax(excess[:, column]))
            arm, joint = plan.joints[first + column]
            value, limit = float(abs(rate[row, column])), float(allowed[row, column])
            unit = plan.units[first + column] + per
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
