"""A monitor of executions: all arms stop on their common phase when one lags, and go on when it has caught up.

The phase is the plan's own time. Whoever slows it down moves nobody off the path, so arms that follow stay as clear of
each other as the plan is proved to be. `PhaseClock` does it within what joints' accelerations and jerks leave.
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
    """When to stop and when to go on.

    All arms stop when a joint is farther than `lag_rad` from where it should be, and go on when none is farther than
    `caught_up_rad`. After `patience_s` at rest, all in all since the plan last was at its full speed, the execution is
    given up.
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
    """From `time_s` [s] of the execution on `joint` (from 1) of `arm` lagged, by `lag_rad` at most; at `until_s` it had
    caught up, None where the execution was given up. `phase_s` [s] is the farthest that the plan went on meanwhile.
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


class Watch:
    """A monitor at work on one execution: `halts` so far, in the order of time."""

    def __init__(self, monitor: Monitor, clock: PhaseClock, joints: list[tuple[str, int]]) -> None:
        """`joints`: arm and number of each joint."""
        self.halts: list[Halt] = []
        self._monitor, self._clock, self._joints = monitor, clock, joints
        self._lagging: int | None = None  # the joint of an open halt
        self._resting_s = 0.0

    @property
    def over(self) -> bool:
        """Whether there is nothing left to wait for: the plan is at its end and nobody lags, or patience is."""
        return self._impatient or (self._clock.over and self._lagging is None)

    @property
    def _impatient(self) -> bool:
        return self._resting_s >= self._monitor.patience_s

    def look(self, time_s: float, lag: Float[np.ndarray, "n"], step_s: float) -> None:
        """Stops the clock or lets it go on, a step of time after the last look; `lag` [rad] of all joints."""
        worst = int(np.argmax(lag))
        if self._lagging is not None:
            self._go_on(time_s, lag)
        elif lag[worst] > self._monitor.lag_rad:
            self._stop(time_s, worst, float(lag[worst]))
        # Only at full speed everything is well again: who lags at each attempt to go on is not waited for for ever.
        if self._clock.at_rest or self._clock.over:
            self._resting_s += step_s
        elif self._clock.speed == 1.0:
            self._resting_s = 0.0

    def _stop(self, time_s: float, joint: int, lag: float) -> None:
        arm, number = self._joints[joint]
        self.halts.append(Halt(time_s=time_s, arm=arm, joint=number, lag_rad=lag, phase_s=self._clock.plan_s))
        self._clock.turn(0.0)
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
            self._clock.turn(1.0)
            self._lagging = None
