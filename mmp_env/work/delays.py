"""When motions begin if some of them are delayed: each waits until those that the order names are past."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import given, number, whole
from mmp_env.work.schedule import MotionId, OrderPair, Schedule, WorkEvent, numbered

LONGEST_DELAY_S = 3600.0
"""Longest delay of a motion [s]."""
LARGEST_SEED = 2**32 - 1
"""Largest seed of random delays."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ActualTimes:
    """When the events of a schedule really happen.

    Attributes:
        begins: begin of each event [s], by arm and number.
        phases: arm name -> times of the schedule [k] [s] and actual times [k] [s] at which the arm is there, ascending.
    """

    begins: Mapping[MotionId, float]
    phases: Mapping[str, tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"]]]

    @property
    def end_s(self) -> float:
        """When the last motion ends [s]."""
        return max(float(actual[-1]) for _, actual in self.phases.values())

    def phase(self, arm: str, times: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Returns the times of the schedule [n] [s] at which an arm is at actual times [n] [s]."""
        planned, actual = self.phases[arm]
        return np.interp(times, actual, planned)


def actual_times(schedule: Schedule, delays: Mapping[MotionId, float]) -> ActualTimes:
    """Returns when events happen if they are delayed.

    An event begins when it is due, when the one before it of its arm has ended, and when the motions that the order
    names are past; and its delay later. The events of a group begin at once.

    Args:
        schedule: the schedule.
        delays: delay [s] of each event, by arm and number; 0 for those that are left out.
    """
    events = numbered(schedule.events)
    waits: dict[MotionId, list[OrderPair]] = {}
    for pair in schedule.order:
        waits.setdefault(pair.second, []).append(pair)
    arm_order = {name: k for k, name in enumerate(schedule.problem.cell.arm_names)}
    begins: dict[MotionId, float] = {}
    # By their due times, so that all that an event waits for comes before it.
    due = sorted(events, key=lambda name: (events[name].begin_s, name[1], arm_order[name[0]]))
    for name in due:
        if name in begins:
            continue
        group = events[name].group
        members = [name] if group is None else [other for other in due if events[other].group == group]
        begin = max(_may_begin(other, events, begins, waits) + delays.get(other, 0.0) for other in members)
        begins |= dict.fromkeys(members, begin)
    return ActualTimes(begins=begins, phases={arm: _phases(arm, events, begins) for arm in arm_order})


def random_delays(schedule: Schedule, longest_s: float, seed: int) -> dict[MotionId, float]:
    """Returns a random delay of each event [s], uniform from 0 to the longest one.

    Raises:
        MmpError: for a wrong number.
    """
    given("schedule", schedule, Schedule, "a Schedule, such as load_schedule gives")
    allowed = f"a number of seconds from 0 to {LONGEST_DELAY_S:g}"
    longest = number("the longest delay", longest_s, allowed, zero=True)
    rng = np.random.default_rng(whole("seed", seed, 0, LARGEST_SEED))
    names = list(numbered(schedule.events))
    return dict(zip(names, rng.uniform(0.0, min(longest, LONGEST_DELAY_S), len(names)).tolist(), strict=True))


def _may_begin(
    name: MotionId,
    events: Mapping[MotionId, WorkEvent],
    begins: Mapping[MotionId, float],
    waits: Mapping[MotionId, list[OrderPair]],
) -> float:
    arm, index = name
    out = events[name].begin_s
    if index > 0:
        before = arm, index - 1
        out = max(out, begins[before] + events[before].end_s - events[before].begin_s)
    return max([out, *(begins[pair.first] + pair.past_s for pair in waits.get(name, []))])


def _phases(
    arm: str, events: Mapping[MotionId, WorkEvent], begins: Mapping[MotionId, float]
) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"]]:
    planned, actual = [0.0], [0.0]
    for name, event in events.items():
        if name[0] == arm:
            begin = begins[name]
            planned += [event.begin_s, event.end_s]
            actual += [begin, begin + event.end_s - event.begin_s]
    return np.array(planned), np.maximum.accumulate(np.array(actual))
