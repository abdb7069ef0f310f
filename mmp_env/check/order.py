"""The rule of order: pairs of motions keep their order, and what they leave open is clear whenever the arms do it.

An event of an arm begins when all that its pairs name is past. So two arms are never in parts of their motions that the
order excludes. The rule proves that all other parts of two motions are clear of each other at any two times, as swept
volumes. docs/explanation/schedules.md has the theorem.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mmp_env.check.objects import Handled, Hold, Use
from mmp_env.check.report import Violation
from mmp_env.check.swept_parts import SweptParts
from mmp_env.check.work import TIME_TOLERANCE_S, Event, Work


@dataclass(frozen=True, kw_only=True)
class Pair:
    """`second` (arm and number of an event) begins when `first` has lasted for `past` [s], or later."""

    first: tuple[str, int]
    second: tuple[str, int]
    past: float


@dataclass(frozen=True, kw_only=True)
class _Stage:
    """An event of one arm, and the rest after it: number of the event (-1: the start), and its window [periods].

    `hold`: number of what the arm holds then.
    """

    index: int
    begin: int
    end: int
    group: int | None
    hold: int | None = None


def broken_order(
    work: Work, pairs: Sequence[Pair], distance: float, handled: Handled | None = None
) -> Iterator[Violation]:
    """Yields a violation for every pair that the times break, and for motions that may meet although pairs are kept.

    Args:
        work: the schedule.
        pairs: its order.
        distance: clearance between arms [m].
        handled: what the grasps and releases do.
    """
    handled = Handled(states=[]) if handled is None else handled
    faults = [*_wrong_pairs(work, pairs), *_wrong_groups(work), *_late_jobs(work, pairs)]
    if not faults:
        faults += _late_uses(work, pairs, handled)  # counts periods, which needs pairs within their motions
    yield from faults
    if not faults:
        yield from _meetings(work, pairs, distance, handled.holds)


def _wrong_pairs(work: Work, pairs: Sequence[Pair]) -> Iterator[Violation]:
    """Every pair names events of two arms, and the times keep it."""
    for pair in pairs:
        events = [_event(work, name) for name in (pair.first, pair.second)]
        words = " and ".join(f"event {index} of '{arm}'" for arm, index in (pair.first, pair.second))
        if events[0] is None or events[1] is None or pair.first[0] == pair.second[0]:
            yield _fault(f"the order names {words}; they must be events of two arms")
            continue
        first, second = events[0], events[1]
        if not -TIME_TOLERANCE_S <= pair.past <= first.end - first.begin + TIME_TOLERANCE_S:
            yield _fault(f"the order of {words} asks for {pair.past:g} s of the first, which it never reaches", first)
        elif second.begin < first.begin + pair.past - TIME_TOLERANCE_S:
            yield _fault(f"{words} are not in their order: the second begins at {second.begin:g} s", second)
        elif second.begin <= first.begin + TIME_TOLERANCE_S:
            yield _fault(f"{words} begin at once, so neither can wait for the other", second)


def _wrong_groups(work: Work) -> Iterator[Violation]:
    """The events of a group begin and end at once, one for each arm."""
    groups: dict[int, list[Event]] = {}
    for event in work.events:
        if event.group is not None:
            groups.setdefault(event.group, []).append(event)
    for number, events in groups.items():
        begins, ends = [event.begin for event in events], [event.end for event in events]
        apart = max(max(begins) - min(begins), max(ends) - min(ends)) > TIME_TOLERANCE_S
        if apart or sorted(event.arm for event in events) != sorted(work.motions):
            yield _fault(f"the events of group {number} do not begin and end at once, one for each arm", events[0])


def _late_jobs(work: Work, pairs: Sequence[Pair]) -> Iterator[Violation]:
    """A job waits for those that it comes after, however they are delayed."""
    known = {(pair.first, pair.second): pair.past for pair in pairs}
    for job in work.jobs:
        own = work.of_job(job.name)
        for name in job.after:
            before = work.of_job(name)
            if not own or not before or before[-1].arm == own[0].arm:
                continue
            key = _number(work, before[-1]), _number(work, own[0])
            if known.get(key, -np.inf) < before[-1].end - before[-1].begin - TIME_TOLERANCE_S:
                yield _fault(f"the order does not let job '{job.name}' wait for job '{name}'", own[0])


def _late_uses(work: Work, pairs: Sequence[Pair], handled: Handled) -> Iterator[Violation]:
    """A grasp or release waits for the ones before it of the same object, and of what that object lies on."""
    waits = _waits(work, pairs, next(iter(work.motions.values())).period)
    latest: dict[str, Use] = {}
    for use in handled.uses:
        for before in {latest[name] for name in use.names if name in latest}:
            arm, other = use.event.arm, before.event.arm
            if arm != other and waits[arm, other][use.index][0] <= before.index - 1:
                yield _fault(
                    f"the order does not let the {use.event.kind} of '{use.event.object}' wait for the"
                    f" {before.event.kind} of '{before.event.object}'",
                    use.event,
                )
        latest |= dict.fromkeys(use.names, use)


def _meetings(work: Work, pairs: Sequence[Pair], distance: float, holds: Sequence[Hold]) -> Iterator[Violation]:
    """All parts of two motions that the order does not exclude are clear of each other."""
    volumes = SweptParts(work.model, work.motions, [(hold.arm, hold.solid) for hold in holds])
    stages = {arm: _stages(work, arm, volumes.period, holds) for arm in work.motions}
    waits = _waits(work, pairs, volumes.period)
    whole = {arm: [(arm, each.begin, each.end, each.hold) for each in stages[arm]] for arm in stages}
    for a, b in combinations(work.motions, 2):
        # We compare whole stages first. Most are far apart, and the windows that the order leaves open lie within them.
        for i, j in np.argwhere(volumes.near(whole[a], whole[b], distance)):
            one, other = stages[a][i], stages[b][j]
            windows = _open(one, other, waits[a, b], waits[b, a])
            if windows is not None:
                clearance = volumes.clearance((a, *windows[0], one.hold), (b, *windows[1], other.hold), distance)
                if clearance < distance:
                    yield _fault(
                        f"a delay could let {_name(a, one)} and {_name(b, other)} meet: no pair of the order keeps them"
                        f" apart, and {clearance * 1e3:.3g} mm between them are proved",
                        time=max(one.begin, other.begin) * volumes.period,
                        arms=(a, b),
                    )


def _open(
    one: _Stage, other: _Stage, waits: Mapping[int, tuple[int, int]], back: Mapping[int, tuple[int, int]]
) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Returns the windows [periods] of two stages that may be at the same time; None if there are none.

    `waits` tells for each event of the first arm how far the second one is when it begins, `back` the reverse.
    """
    if one.group is not None and one.group == other.group:
        return None  # on one clock, so the nominal motion is all that happens
    need, need_back = waits[one.index], back[other.index]
    if other.index < need[0] or one.index < need_back[0]:
        return None
    begin = other.begin + (need[1] if other.index == need[0] else 0)
    begin_back = one.begin + (need_back[1] if one.index == need_back[0] else 0)
    return (min(begin_back, one.end), one.end), (min(begin, other.end), other.end)


def _stages(work: Work, arm: str, period: float, holds: Sequence[Hold]) -> list[_Stage]:
    """Returns the start of an arm, its motions, and its grasps and releases.

    Waits belong to the rest after the motion before them.
    """
    mine = [(k, hold) for k, hold in enumerate(holds) if hold.arm == arm]
    out = [_Stage(index=-1, begin=0, end=0, group=None)]
    for index, event in enumerate(work.of_arm(arm)):
        if work.motions[arm].moves(event.begin, event.end) or event.group is not None or event.object is not None:
            begin, end = round(event.begin / period), round(event.end / period)
            hold = next((k for k, h in mine if h.first <= index and (h.until is None or index < h.until)), None)
            out.append(_Stage(index=index, begin=begin, end=end, group=event.group, hold=hold))
    return out


def _waits(work: Work, pairs: Sequence[Pair], period: float) -> dict[tuple[str, str], dict[int, tuple[int, int]]]:
    """Returns for two arms and each event of the first: which event of the second has begun, and for how long.

    The number of an event is followed by whole periods, rounded down. What an event waits for is past for later ones.
    """
    direct: dict[tuple[str, int], list[tuple[str, int, int]]] = {}
    for pair in pairs:
        past = int(np.floor(pair.past / period + 1e-6))
        direct.setdefault(pair.second, []).append((*pair.first, past))
    groups = {event.group for event in work.events if event.group is not None}
    members = {group: [_number(work, e) for e in work.events if e.group == group] for group in groups}
    out = {}
    for arm in work.motions:
        for other in work.motions:
            known, here = (-1, 0), {-1: (-1, 0)}
            for index, event in enumerate(work.of_arm(arm)):
                found = [(n, p) for name, n, p in direct.get((arm, index), []) if name == other]
                if event.group is not None:
                    found += [(n, 0) for name, n in members[event.group] if name == other]
                known = max([known, *found])
                here[index] = known
            out[arm, other] = here
    return out


def _event(work: Work, name: tuple[str, int]) -> Event | None:
    arm, index = name
    events = work.of_arm(arm) if arm in work.motions else []
    return events[index] if 0 <= index < len(events) else None


def _number(work: Work, event: Event) -> tuple[str, int]:
    return event.arm, work.of_arm(event.arm).index(event)


def _name(arm: str, stage: _Stage) -> str:
    return f"arm '{arm}' at its start" if stage.index < 0 else f"event {stage.index} of arm '{arm}'"


def _fault(
    message: str, event: Event | None = None, *, time: float | None = None, arms: tuple[str, ...] = ()
) -> Violation:
    if event is not None:
        time, arms = event.begin, (event.arm,)
    return Violation(rule="order", message=message, time_s=time, arms=arms)
