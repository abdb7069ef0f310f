"""How a plan is to be retimed."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.retime.limits import Given

LEAST_RATE_HZ, LARGEST_RATE_HZ = 20.0, 1e5
"""Between samples farther apart, straight as they are, the tolerance would not hold; closer ones are rounding."""


@dataclass(frozen=True, kw_only=True)
class RetimeOptions:
    """`rate` [Hz]: samples per second. `tolerance` [rad]: no joint is farther from the plan's path than that. `share`:
    what the motion uses of the acceleration and jerk limits; the rest is for whoever has to slow it down on its way
    (`mmp_env.sim.monitor`). `max_acceleration` [rad/s^2] and `max_jerk` [rad/s^3]: a number for all joints, or arm ->
    [dof]; the robots' own where none are given.

    Raises `MmpError` for numbers that cannot be.
    """

    rate: float = 250.0
    tolerance: float = 0.05
    share: float = 0.9
    max_acceleration: Given = None
    max_jerk: Given = None

    def __post_init__(self) -> None:
        for what, most in (("rate", LARGEST_RATE_HZ), ("tolerance", np.pi), ("share", 1.0)):
            value = getattr(self, what)
            if not isinstance(value, Real) or not 0 < float(value) <= most:
                raise MmpError(f"{what} is {value!r}; it must be a positive number, {most:g} at most")
        if self.rate < LEAST_RATE_HZ:
            raise MmpError(f"rate is {self.rate:g}; a motion needs at least {LEAST_RATE_HZ:g} samples a second")

    @classmethod
    def of(cls, given: dict[str, Any]) -> RetimeOptions:
        """Raises `MmpError` for a name that is no option."""
        known = [field.name for field in dataclasses.fields(cls)]
        for name in given:
            if name not in known:
                raise UnknownNameError("option of retiming", name, known)
        return cls(**given)
