"""A retimed plan with the phase that the arms follow: from its begin on, and where it brakes.

The phase is the time of the plan. It never leaves the curve of the plan, so what is proved of the curve holds at every
speed of the phase. `PhaseClock` brakes and goes on within the limits of acceleration and jerk.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.certificate import certify
from mmp_env.model.goals import GivenGoal
from mmp_env.model.plan import Plan
from mmp_env.retime.limits import split
from mmp_env.sim.phase_clock import PhaseClock
from mmp_env.sim.servo_reference import Reference

PERIOD_S = 0.01
"""Period of the phase [s]: motions begin, brake and end at multiples of it."""
STRAY_RAD = 5e-6
"""Largest distance [rad, of slides m] of the curve from the lines that the certificate proves."""
_PART_S = 1.0
"""Time of the plan that is proved at once [s], halved where the proof fails."""
_MOST_PARTS = 64
_TINY_S = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseTiming:
    """A way to run through a motion: the phase at all multiples of the period from `first` on, until it rests.

    Attributes:
        first: number of periods since the begin of the motion.
        phases: [k] [s], the phase at `first` and after; the last one is where the arms come to rest.
        brakes: number of periods since the begin at which the phase begins to brake; None if it runs to the end.
    """

    first: int
    phases: Float[np.ndarray, "k"]
    brakes: int | None


class _Known(NamedTuple):
    """The clock of the phase at a number of periods since the begin, and where it will brake."""

    at: float
    clock: PhaseClock
    brakes: int | None

    def copy(self) -> _Known:
        return self._replace(clock=self.clock.copy())


class OnlineMotion:
    """A motion of all arms from rest to rest, of which the arms follow what is committed.

    Args:
        plan: the retimed plan.
        goal: what the motion leads to, as a user gave it.
        waiting: arms that stand meanwhile, and are not at their goals afterwards.

    Attributes:
        begin: when it begins, in periods; may change as long as nothing is committed.
        proved_s: the curve is proved up to this phase [s].
        whole: whether the curve can be proved; False once the proof has failed at `proved_s`.
    """

    def __init__(self, plan: Plan, goal: Mapping[str, GivenGoal], waiting: frozenset[str] = frozenset()) -> None:
        self.plan, self.goal, self.waiting, self.begin = plan, goal, waiting, 0
        self.reference = Reference(plan, plan.problem.start)
        clock = PhaseClock(self.reference)
        self.first_s, self.end_s = self.reference.start_s, self.reference.end_s
        self.proved_s, self.whole = self.first_s, True
        self._part_s = _PART_S
        self.timing = PhaseTiming(first=0, phases=np.array([self.first_s]), brakes=0)
        self._known = [_Known(0, clock, None)]
        pieces = self.reference.pieces()
        bend = np.abs(pieces.acceleration).max(axis=1) * pieces.step_s**2
        self._parts = np.clip(np.ceil(np.sqrt(bend / (8 * STRAY_RAD))), 1, _MOST_PARTS).astype(int)
        self._step_s = pieces.step_s
        self.stray_rad = float(np.abs(pieces.acceleration).max()) * PERIOD_S**2 / 8

    @property
    def end(self) -> int:
        """When the arms rest, in periods."""
        return self.begin + self.timing.first + len(self.timing.phases) - 1

    @property
    def ends(self) -> bool:
        """Whether the committed part leads to the end of the motion."""
        return bool(self.timing.phases[-1] >= self.end_s - _TINY_S)

    @property
    def arrives(self) -> bool:
        """Whether the committed part leads all arms to their goals."""
        return self.ends and not self.waiting

    @property
    def moves(self) -> bool:
        """Whether the committed part moves at all."""
        return bool(self.timing.phases[-1] > self.first_s)

    def phase(self, period: int) -> float:
        """Returns the phase [s] at a time in periods."""
        at = np.clip(period - self.begin - self.timing.first, 0, len(self.timing.phases) - 1)
        return float(self.timing.phases[int(at)])

    def phases(self, periods: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Returns the exact phases [s] at ascending times in periods, which need not be whole."""
        out, later = [], list(self._known)
        at, clock, brakes = later.pop(0).copy()
        for period in np.maximum(periods - self.begin, 0.0).tolist():
            while later and later[0].at <= period:
                at, clock, brakes = later.pop(0).copy()
            if brakes is not None and at <= brakes < period:
                clock.advance(PERIOD_S * (brakes - at))
                clock.set_target(0.0)
                at, brakes = brakes, None
            clock.advance(PERIOD_S * max(period - at, 0.0))
            at = max(period, at)
            out.append(clock.phase)
        return np.array(out)

    def at(self, phases: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dofs"]:
        """Returns the configurations of all joints at phases."""
        return self.reference.at(phases)[0]

    def timing_from(self, period: int, brakes: int | None) -> PhaseTiming:
        """Returns the timing that leaves the committed one at a time.

        Args:
            period: when, in periods.
            brakes: when it begins to brake, in periods, not before; None to run to the end.
        """
        first = max(period - self.begin, 0)
        clock = self._clock_at(first)
        phases = [clock.phase]
        clock.set_target(1.0 if brakes is None or brakes > period else 0.0)
        stop = None if brakes is None else max(brakes - self.begin, first)
        k = first
        while not (clock.over or (stop is not None and k >= stop and clock.at_rest)):
            if k == stop:
                clock.set_target(0.0)
            if clock.speed == 1.0 and clock.acceleration == 0.0 and (stop is None or k < stop):
                left = int(np.ceil((self.end_s - clock.phase) / PERIOD_S - 1e-9))
                run = left if stop is None else min(left, stop - k)
                phases += np.minimum(clock.phase + PERIOD_S * np.arange(1, run + 1), self.end_s).tolist()
                clock.advance(PERIOD_S * run)
                k += run
                continue
            clock.advance(PERIOD_S)
            phases.append(clock.phase)
            k += 1
        return PhaseTiming(first=first, phases=np.maximum.accumulate(phases), brakes=stop)

    def timing_left(self, period: int) -> PhaseTiming:
        """Returns what is left of the committed timing at a time in periods."""
        at = int(np.clip(period - self.begin - self.timing.first, 0, len(self.timing.phases) - 1))
        return PhaseTiming(first=self.timing.first + at, phases=self.timing.phases[at:], brakes=self.timing.brakes)

    def is_proved(self, timing: PhaseTiming) -> bool:
        """Returns whether the part of the curve that a timing runs through is proved."""
        return bool(timing.phases[-1] <= self.proved_s + _TINY_S)

    def commit(self, timing: PhaseTiming) -> None:
        """Replaces what is committed from the begin of a timing on."""
        clock = self._clock_at(timing.first)
        clock.set_target(1.0 if timing.brakes is None or timing.brakes > timing.first else 0.0)
        self._known = [each for each in self._known if each.at < timing.first]
        self._known.append(_Known(timing.first, clock, timing.brakes))
        known, count = self.timing.phases, timing.first - self.timing.first
        before = np.append(known[:count], np.repeat(known[-1:], max(count - len(known), 0)))  # at rest until then
        self.timing = PhaseTiming(
            first=self.timing.first,
            phases=np.append(before, timing.phases),
            brakes=timing.brakes,
        )

    def forget(self, period: int) -> None:
        """Forgets the phases before a time in periods."""
        first = period - self.begin
        while len(self._known) > 1 and self._known[1].at <= first:
            del self._known[0]
        if first > self.timing.first:
            drop = min(first - self.timing.first, len(self.timing.phases) - 1)
            self.timing = PhaseTiming(
                first=self.timing.first + drop, phases=self.timing.phases[drop:], brakes=self.timing.brakes
            )

    def prove(self, clock: core.Clock) -> None:
        """Proves more of the curve: that the arms keep all margins to each other, to the cell and to themselves."""
        before_s = self.proved_s
        while self.whole and self.proved_s < self.end_s - _TINY_S and not clock.expired:
            times, q = self._points(self.proved_s, min(self.proved_s + self._part_s, self.end_s))
            rows = {name: np.ascontiguousarray(part) for name, part in split(self.plan.problem.cell, q).items()}
            part = Plan(problem=self.plan.problem, times=times - times[0], positions=rows)
            certificate = certify(part, clock, share=1.0)
            if certificate.valid:
                self.proved_s = float(times[-1])
            elif not clock.expired:
                self._part_s /= 2
                self.whole = self._part_s >= self._step_s
            elif self.proved_s == before_s:  # a call of this length has no time for such a part
                self._part_s = max(self._part_s / 2, self._step_s)

    def _points(self, begin_s: float, end_s: float) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n dofs"]]:
        """Returns phases and configurations, so close that the curve strays from lines by `STRAY_RAD` at most."""
        first = int(np.clip(np.floor((begin_s - self.first_s) / self._step_s + 1e-9), 0, len(self._parts) - 1))
        last = int(np.clip(np.ceil((end_s - self.first_s) / self._step_s - 1e-9), first + 1, len(self._parts)))
        parts = self._parts[first:last]
        nth = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        steps = np.append(np.repeat(np.arange(first, last), parts) + nth / np.repeat(parts, parts), last)
        times = self.first_s + self._step_s * steps
        return times, self.at(times)

    def _clock_at(self, k: int) -> PhaseClock:
        """Returns a copy of the clock at a number of periods since the begin."""
        at, clock, brakes = next(each for each in reversed(self._known) if each.at <= k).copy()
        if brakes is not None and at <= brakes < k:
            clock.advance(PERIOD_S * (brakes - at))
            clock.set_target(0.0)
            at = brakes
        clock.advance(PERIOD_S * (k - at))
        return clock
