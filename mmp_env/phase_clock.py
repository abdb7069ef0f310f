"""The phase of a retimed plan while it is executed: brought to rest and up to speed again, within joints' limits.

At speed s of the phase a joint has velocity q's, acceleration q''s^2 + q's' and jerk q'''s^3 + 3q''ss' + q's''. A plan
that was retimed with a share of its limits leaves the rest of them for s' and s''. Ruckig times the changes of speed.
"""

from __future__ import annotations

import numpy as np
import ruckig

from mmp_env.errors import MmpError
from mmp_env.reference import Reference

LEAST_GROWTH = 0.05
"""[1/s]: a plan whose phase cannot be slowed down any faster than that leaves nothing worth the name."""
_WINDOWS_S = 0.05 * 1.4 ** np.arange(24)
_MOST, _TINY = 1e3, 1e-9


class PhaseClock:
    """`phase` [s] is the plan's time, `speed` how fast it passes (1: as planned), `growth` [1/s] how that changes."""

    def __init__(self, reference: Reference) -> None:
        """Raises `MmpError` for a plan that is not retimed, or has been so without a reserve."""
        if reference.velocities is None or reference.accelerations is None:
            raise MmpError("a monitor needs a plan that knows its velocities and accelerations; retime it first")
        self._times, self._end = reference.times, reference.end_s
        self._rate = np.maximum(np.abs(reference.velocities), _TINY)
        self._growth = np.abs(reference.accelerations)
        self._jerk = np.zeros_like(self._growth)
        self._jerk[:-1] = np.abs(np.diff(reference.accelerations, axis=0)) / np.diff(self._times)[:, None]
        self._limits = reference.max_acceleration, reference.max_jerk
        if self._room(0.0, np.inf)[0] < LEAST_GROWTH:
            raise MmpError("the plan is at its limits, so it cannot be slowed down; retime it with a share below 1")
        self._target, self._bounds = 1.0, (_MOST, _MOST)
        self.phase, self.speed, self.growth = 0.0, 1.0, 0.0

    @property
    def at_rest(self) -> bool:
        return self.speed == 0.0

    @property
    def over(self) -> bool:
        """Whether the plan has come to its end."""
        return self.phase >= self._end - _TINY

    def turn(self, target: float) -> None:
        """From now on to the speed `target`, 0 or 1, as fast as joints' limits allow all the way there."""
        if target == self._target:
            return
        self._target = target
        for window in _WINDOWS_S:
            growth, jerk = self._bounds = self._room(self.phase, window)
            lasting = abs(target - self.speed) / max(growth, _TINY) + 2 * growth / jerk
            if max(target, self.speed) * lasting <= window:
                return

    def advance(self, step_s: float) -> None:
        """Lets time pass."""
        if self.speed == self._target and self.growth == 0.0:
            self.phase = min(self.phase + self.speed * step_s, self._end)
            return
        given = ruckig.InputParameter(1)
        given.control_interface = ruckig.ControlInterface.Velocity
        given.current_position, given.current_velocity = [self.phase], [self.speed]
        given.current_acceleration, given.target_velocity = [self.growth], [self._target]
        given.max_acceleration, given.max_jerk = [self._bounds[0]], [self._bounds[1]]
        trajectory = ruckig.Trajectory(1)
        result = ruckig.Ruckig(1).calculate(given, trajectory)
        if result not in (ruckig.Result.Working, ruckig.Result.Finished):
            raise RuntimeError(f"Ruckig finds no way from speed {self.speed} to {self._target}: {result}")
        (phase,), (speed,), (growth,) = trajectory.at_time(step_s)
        # Rounding must not send the phase back, nor keep it from coming to rest.
        self.phase = float(np.clip(phase, self.phase, self._end))
        there = trajectory.duration <= step_s
        self.speed, self.growth = (self._target, 0.0) if there else (max(speed, 0.0), growth)

    def _room(self, begin_s: float, lasting_s: float) -> tuple[float, float]:
        """Bounds on s' and s'' anywhere in a stretch of the phase, for s from 0 to 1."""
        first = max(int(np.searchsorted(self._times, begin_s, side="right")) - 1, 0)
        last = int(np.searchsorted(self._times, begin_s + lasting_s)) + 1
        rate, growth, jerk = (values[first:last] for values in (self._rate, self._growth, self._jerk))
        most = float(((self._limits[0] - growth) / rate).min().clip(0.0, _MOST))
        jolt = float(((self._limits[1] - jerk - 3 * growth * most) / rate).min().clip(LEAST_GROWTH, _MOST**2))
        return most, jolt
