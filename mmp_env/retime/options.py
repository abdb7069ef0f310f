"""Options of retiming."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.model.problem import LEAST_LIMIT
from mmp_env.retime.limits import JointLimits

LEAST_RATE_HZ, LARGEST_RATE_HZ = 20.0, 1e5
"""Bounds of the sampling rate [Hz]. Below, straight lines between samples leave the tolerance; above is rounding."""


@dataclass(frozen=True, kw_only=True)
class RetimeOptions:
    """Options of `retime`, which describes them.

    Raises:
        MmpError: for a number out of bounds.
    """

    rate: float = 250.0
    tolerance: float = 0.05
    share: float = 0.9
    max_acceleration: JointLimits = None
    max_jerk: JointLimits = None

    def __post_init__(self) -> None:
        for what, most in (("rate", LARGEST_RATE_HZ), ("tolerance", np.pi), ("share", 1.0)):
            value = getattr(self, what)
            if not isinstance(value, Real) or not 0 < float(value) <= most:
                raise MmpError(f"{what} is {value!r}; it must be a positive number, {most:g} at most")
        if self.rate < LEAST_RATE_HZ:
            raise MmpError(f"rate is {self.rate:g}; a motion needs at least {LEAST_RATE_HZ:g} samples a second")
        for what in ("max_acceleration", "max_jerk"):  # limits of single arms wait for the cell
            value = getattr(self, what)
            if isinstance(value, float | np.floating) and 0 < float(value) < LEAST_LIMIT:
                raise MmpError(f"{what} is {float(value)!r}; it must be {LEAST_LIMIT:g} at least")
