"""A monitor of executions: all arms stop on their common phase when one lags, and go on when it has caught up.

The phase is the plan's own time. Whoever slows it down moves nobody off the path, so arms that follow stay as clear of
each other as the plan is proved to be. `PhaseClock` does it within what joints' accelerations and jerks leave.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.phase_clock import PhaseClock


@dataclass(frozen=True, kw_only=True)
class Monitor:
    """When to stop and when to go on.

    All arms stop when a joint is farther than `lag_rad` from where it should be, and go on when none is farther than
    `caught_up_rad`. After `patience_s` at rest the execution is given up.
    """

    lag_rad: float = 0.02
    caught_up_rad: float = 0.005
    patience_s: float = 10.0

    def __post_init__(self) -> None:
        if not 0 < self.caught_up_rad <= self.lag_rad or not self.patience_s > 0:
            raise MmpError("a monitor needs 0 < caught_up_rad <= lag_rad and a patience_s above 0")


@dataclass(frozen=True, kw_only=True)
class Halt:
    """From `time_s` [s] of the execution on `joint` (from 1) of `arm` lagged, by `lag_rad` at most; at `until_s` it had
    caught up, None where it did not. `phase_s` [s] is the farthest that the plan went on meanwhile.
    """

    time_s: float
    arm: str
    joint: int
    lag_rad: float
    phase_s: float
    until_s: float | None = None


class Watch:
    """A monitor at work on one execution: `halts` so far, in the order of time."""

    def __init__(self, monitor: Monitor, clock: PhaseClock, joints: list[tuple[str, int]]) -> None:
        """`joints`: arm and number of each joint."""
        self.halts: list[Halt] = []
        self._monitor, self._clock, self._joints = monitor, clock, joints
        self._resting_s = 0.0

    def look(self, time_s: float, lag: Float[np.ndarray, "n"], step_s: float) -> bool:
        """Stops the clock or lets it go on; `lag` [rad] of all joints. False when patience is at an end."""
        worst = int(np.argmax(lag))
        if not self.halts or self.halts[-1].until_s is not None:
            if lag[worst] > self._monitor.lag_rad:
                self._begin(time_s, worst, float(lag[worst]))
            return True
        halt = self.halts[-1]
        caught_up = lag[worst] <= self._monitor.caught_up_rad
        self.halts[-1] = replace(
            halt,
            lag_rad=max(halt.lag_rad, float(lag[self._joints.index((halt.arm, halt.joint))])),
            phase_s=self._clock.phase,
            until_s=time_s if caught_up else None,
        )
        if caught_up:
            self._clock.turn(1.0)
        self._resting_s += step_s * self._clock.at_rest
        return self._resting_s < self._monitor.patience_s

    def _begin(self, time_s: float, joint: int, lag: float) -> None:
        arm, number = self._joints[joint]
        self.halts.append(Halt(time_s=time_s, arm=arm, joint=number, lag_rad=lag, phase_s=self._clock.phase))
        self._clock.turn(0.0)
        self._resting_s = 0.0
