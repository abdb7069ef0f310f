"""Monitor of executions: all arms stop on their common phase when one lags, and continue when it has caught up.

The phase is the time of the plan. A slower phase moves no arm off its path, so the arms keep the clearance that is
proved of the plan. `PhaseClock` changes the speed of the phase within the limits of acceleration and jerk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import given
from mmp_env.errors import MmpError
from mmp_env.sim.phase_clock import PhaseClock


@dataclass(frozen=True, kw_only=True)
class Monitor:
    """Thresholds of a monitor.

    Args:
        lag_rad: all arms stop when a joint is farther than this from its reference [rad].
        caught_up_rad: they continue when no joint is farther than this from its reference [rad].
        patience_s: total time at rest since the plan was at full speed, after which the execution is given up [s].

    Raises:
        MmpError: for thresholds that are not positive and finite, or `caught_up_rad` above `lag_rad`.
    """

    lag_rad: float = 0.02
    caught_up_rad: float = 0.005
    patience_s: float = 10.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            given(name, value, Real, "a finite number above 0")
        if not 0 < self.caught_up_rad <= self.lag_rad < math.inf or not 0 < self.patience_s < math.inf:
            raise MmpError("a monitor needs 0 < caught_up_rad <= lag_rad and a patience_s above 0, all of them finite")


@dataclass(frozen=True, kw_only=True)
class Halt:
    """A halt from `time_s` to `until_s` [s] of the execution, because `joint` (from 1) of `arm` lagged.

    `lag_rad` is its largest lag. `until_s` is None if the execution was given up. `phase_s` is the time of the plan [s]
    at the end of the halt.
    """

    time_s: float
    arm: str
    joint: int
    lag_rad: float
    phase_s: float
    until_s: float | None = None

    def __str__(self) -> str:
        until = "and did not catch up: given up" if self.until_s is None else f"until {self.until_s:.2f} s"
        lagged = f"joint {self.joint} of '{self.arm}' lagged, by {self.lag_rad:.4f} rad at most"
        return f"from {self.time_s:.2f} s on {lagged}, {until}; the plan stood at {self.phase_s:.2f} s"


class MonitorRun:
    """The monitor of one execution, with its `halts` so far in the order of time."""

    def __init__(self, monitor: Monitor, clock: PhaseClock, joints: list[tuple[str, int]]) -> None:
        """Starts the monitor; `joints` are the arm and the number of each joint."""
        self.halts: list[Halt] = []
        self._monitor, self._clock, self._joints = monitor, clock, joints
        self._lagging: int | None = None  # the joint of an open halt
        self._resting_s = 0.0

    @property
    def over(self) -> bool:
        """Whether the plan is at its end and no joint lags, or the execution is given up."""
        return self._impatient or (self._clock.over and self._lagging is None)

    @property
    def _impatient(self) -> bool:
        return self._resting_s >= self._monitor.patience_s

    def update(self, time_s: float, lag: Float[np.ndarray, "n"], step_s: float) -> None:
        """Stops or continues the clock, `step_s` [s] after the last update; `lag` [n] [rad] of all joints."""
        worst = int(np.argmax(lag))
        if self._lagging is not None:
            self._go_on(time_s, lag)
        elif lag[worst] > self._monitor.lag_rad:
            self._stop(time_s, worst, float(lag[worst]))
        # Only full speed resets the time at rest, so an arm that lags in every attempt to continue ends the execution.
        if self._clock.at_rest or self._clock.over:
            self._resting_s += step_s
        elif self._clock.speed == 1.0:
            self._resting_s = 0.0

    def _stop(self, time_s: float, joint: int, lag: float) -> None:
        arm, number = self._joints[joint]
        self.halts.append(Halt(time_s=time_s, arm=arm, joint=number, lag_rad=lag, phase_s=self._clock.plan_s))
        self._clock.set_target(0.0)
        self._lagging = joint

    def _go_on(self, time_s: float, lag: Float[np.ndarray, "n"]) -> None:
        halt, caught_up = self.halts[-1], bool(lag.max() <= self._monitor.caught_up_rad)
        self.halts[-1] = replace(
            halt,
            lag_rad=max(halt.lag_rad, float(lag[self._lagging])),
            phase_s=self._clock.plan_s,
            until_s=time_s if caught_up else None,
        )
        if caught_up:
            self._clock.set_target(1.0)
            self._lagging = None
