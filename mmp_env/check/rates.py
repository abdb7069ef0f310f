"""The rules for retimed plans: acceleration and jerk, and the rates that the file states beside its positions.

Divided differences of a motion are means of its derivatives over a few samples, so they keep every limit that the
motion keeps. A plan that breaks a limit here certainly breaks it. The arms rest before and after the plan.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedPlan
from mmp_env.check.report import Violation
from mmp_env.check.rules import Rates, exceeded

RATE_TOLERANCE = 1e-7
"""Relative tolerance of accelerations, jerks and stated rates, for the rounding of times."""
_ROUNDING = 8 * np.finfo(float).eps


def derivatives(plan: CheckedPlan) -> Iterator[Violation]:
    """Yields violations of acceleration and jerk limits, and of stated rates that differ from the motion."""
    if (np.diff(plan.times) <= 0).any():
        return
    if plan.max_acceleration is not None:
        yield from _above(plan, "acceleration", "has an acceleration of", 2, plan.max_acceleration)
    if plan.max_jerk is not None:
        yield from _above(plan, "jerk", "has a jerk of", 3, plan.max_jerk)
    if plan.velocities is not None:
        yield from _stated(plan, plan.velocities)


def _above(plan: CheckedPlan, rule: str, does: str, order: int, limit: Float[np.ndarray, "n"]) -> Iterator[Violation]:
    """Yields violations by a motion whose derivative of that order is above its limit."""

    def rates(joints: slice) -> Rates:
        return divided_differences(plan.times, plan.positions[:, joints], order), limit[joints]

    yield from exceeded(plan, rule, does, f"/s^{order}", rates, difference_times(plan.times, order), RATE_TOLERANCE)


def _stated(plan: CheckedPlan, v: Float[np.ndarray, "t n"]) -> Iterator[Violation]:
    """Yields violations by stated velocities `v` [rad/s or m/s] and accelerations: beyond limits, or unlike the motion.

    In a step of h [s], the mean of a rate at both ends differs from the rate of the positions (or velocities) by at
    most a h / 4 if the rate changes by at most a per second, and j h^2 / 12 if a changes by at most j per second.
    """
    speed = np.minimum(plan.max_velocity, plan.of_robots("velocity"))
    growth = plan.of_robots("acceleration") if plan.max_acceleration is None else plan.max_acceleration
    jerk = plan.of_robots("jerk") if plan.max_jerk is None else plan.max_jerk
    step = np.diff(plan.times)[:, None]
    q, a, at = plan.positions, plan.accelerations, plan.times

    def velocity_off(joints: slice) -> Rates:
        allowed = np.minimum(growth[joints] * step / 4, jerk[joints] * step**2 / 12)
        return _off(step, q[:, joints], v[:, joints]), allowed

    yield from exceeded(
        plan, "rates", "states a velocity of", "/s", lambda some: (v[:, some], speed[some]), at, RATE_TOLERANCE
    )
    text = "states velocities off those of its motion by"
    yield from exceeded(plan, "rates", text, "/s", velocity_off, at[:-1], RATE_TOLERANCE)
    if a is None:
        return

    def acceleration_off(joints: slice) -> Rates:
        return _off(step, v[:, joints], a[:, joints]), jerk[joints] * step / 4

    yield from exceeded(
        plan, "rates", "states an acceleration of", "/s^2", lambda some: (a[:, some], growth[some]), at, RATE_TOLERANCE
    )
    text = "states accelerations off those of its velocities by"
    yield from exceeded(plan, "rates", text, "/s^2", acceleration_off, at[:-1], RATE_TOLERANCE)


def _off(
    step: Float[np.ndarray, "m 1"], integral: Float[np.ndarray, "t n"], stated: Float[np.ndarray, "t n"]
) -> Float[np.ndarray, "m n"]:
    """Returns the difference between the mean of both ends of each step and that of the integral, less rounding."""
    noise = _ROUNDING * np.maximum(np.abs(integral[1:]), 1.0) / step
    return np.maximum(np.abs(np.diff(integral, axis=0) / step - (stated[1:] + stated[:-1]) / 2) - noise, 0.0)


def divided_differences(
    times: Float[np.ndarray, "t"], q: Float[np.ndarray, "t n"], order: int
) -> Float[np.ndarray, "u n"]:
    """Returns means of the derivative of that order [rad or m per s^order], less rounding, at `difference_times`."""
    clock = _clock(times, order)
    rate = np.pad(q, ((order, order), (0, 0)), mode="edge")
    noise = _ROUNDING * np.maximum(np.abs(rate), 1.0)
    for k in range(1, order + 1):
        span = (clock[k:] - clock[:-k])[:, None] / k
        rate, noise = np.diff(rate, axis=0) / span, (noise[1:] + noise[:-1]) / span
    return np.maximum(np.abs(rate) - noise, 0.0)


def difference_times(times: Float[np.ndarray, "t"], order: int) -> Float[np.ndarray, "u"]:
    """Returns when the means of `divided_differences` begin [s]."""
    return np.clip(_clock(times, order)[: len(times) + order], 0.0, times[-1])


def _clock(times: Float[np.ndarray, "t"], order: int) -> Float[np.ndarray, "c"]:
    """Returns the times with those of `order` more samples before and after them, at rest."""
    first, last = (times[1] - times[0], times[-1] - times[-2]) if len(times) > 1 else (1.0, 1.0)
    beyond = np.arange(1, order + 1)
    return np.concatenate([times[0] - first * beyond[::-1], times, times[-1] + last * beyond])
