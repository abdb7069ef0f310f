"""Which motions must keep their order, so that arms stay clear of each other however they are delayed.

docs/explanation/schedules.md states the theorem and proves it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.work.jobs import Jobs
from mmp_env.work.replay import Replay
from mmp_env.work.schedule import MotionId, OrderPair, WorkEvent, numbered
from mmp_env.work.swept_volumes import SweptMotion, SweptVolumes
from mmp_env.work.trajectory import Trajectory, time_of

AHEAD = 8
"""Number of earlier motions of another arm that a motion is compared with. It waits for the end of the one before."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Placed:
    """A motion of an arm: number of its event, periods at which it begins and ends, and its group."""

    index: int
    begin: int
    end: int
    group: int | None
    swept: SweptMotion


def order_of(
    cell: Cell,
    jobs: Jobs,
    trajectories: Mapping[str, Trajectory],
    events: Sequence[WorkEvent],
    distance: float,
    found: Replay,
) -> tuple[OrderPair, ...]:
    """Returns the pairs of motions that must keep their order.

    Args:
        cell: the arms.
        jobs: the work; a job waits for those that it comes after.
        trajectories: arm name -> its motion.
        events: the events of all arms.
        distance: clearance between arms [m].
        found: what happens to the objects.
    """
    volumes, period_s = SweptVolumes(cell), next(iter(trajectories.values())).period_s
    motions = [
        _motions(volumes, number, trajectories[name], [event for event in events if event.arm == name], found.held)
        for number, name in enumerate(cell.arm_names)
    ]
    out = _after_jobs(jobs, events)
    for a, name in enumerate(cell.arm_names):
        for b, other in enumerate(cell.arm_names):
            if a == b:
                continue
            for first, second, past in _kept(volumes, motions[b], motions[a], distance):
                out.append(OrderPair(first=(other, first), second=(name, second), past_s=time_of(past, period_s)))
    out += _around_objects(events, found, out)
    return tuple(sorted(set(out), key=lambda pair: (pair.second, pair.first, pair.past_s)))


def _motions(
    volumes: SweptVolumes,
    arm: int,
    trajectory: Trajectory,
    events: Sequence[WorkEvent],
    held: Mapping[MotionId, Obstacle],
) -> list[_Placed]:
    """Returns the events of an arm in which it moves, or takes or puts down an object."""
    out = []
    for number, event in numbered(events).items():
        begin, end = (round(time / trajectory.period_s) for time in (event.begin_s, event.end_s))
        rows = trajectory.samples[begin : end + 1]
        if event.solid is not None or (len(rows) and (rows != rows[0]).any()):
            swept = volumes.of(arm, rows, held.get(number))
            out.append(_Placed(index=number[1], begin=begin, end=end, group=event.group, swept=swept))
    return out


def _kept(
    volumes: SweptVolumes, firsts: Sequence[_Placed], seconds: Sequence[_Placed], distance: float
) -> list[tuple[int, int, int]]:
    """Returns the motions of one arm that motions of another wait for: numbers of both, and periods that must be past.

    A pair is left out if an earlier motion of the second arm has waited for as much.
    """
    out, known = [], (-1, 0)
    for second in seconds:
        found = _last_before(volumes, firsts, second, distance, known)
        if found is not None and found > known:
            known = found
            out.append((found[0], second.index, found[1]))
    return out


def _last_before(
    volumes: SweptVolumes, firsts: Sequence[_Placed], second: _Placed, distance: float, known: tuple[int, int]
) -> tuple[int, int] | None:
    """Returns the last motion of an arm that a motion of another waits for, and the period that must be past."""
    compared = 0
    for first in reversed(firsts):
        if (first.group is not None and first.group == second.group) or first.index < known[0]:
            return None  # the group begins as one; or the arm has waited already
        if (first.begin, first.swept.arm) > (second.begin, second.swept.arm):
            continue
        if compared >= AHEAD and first.end <= second.begin:
            return first.index, first.end - first.begin
        compared += 1
        last = volumes.last_conflicts(first.swept, second.swept, distance)[0]
        if last >= 0:
            return first.index, last + 1
    return None


def _after_jobs(jobs: Jobs, events: Sequence[WorkEvent]) -> list[OrderPair]:
    """Returns the pairs that keep jobs after others."""
    of_job: dict[str, list[MotionId]] = {}
    by_id = numbered(events)
    for number, event in by_id.items():
        if event.job is not None:
            of_job.setdefault(event.job, []).append(number)
    out = []
    for job in jobs.jobs:
        second = of_job[job.name][0]
        for name in job.after:
            first = of_job[name][-1]
            if first[0] != second[0]:
                past = round(by_id[first].end_s - by_id[first].begin_s, 9)
                out.append(OrderPair(first=first, second=second, past_s=past))
    return out


def _around_objects(events: Sequence[WorkEvent], found: Replay, known: Sequence[OrderPair]) -> list[OrderPair]:
    """Returns the pairs that keep grasps and releases of an object, and of what lies on it, in their order.

    Args:
        events: the events of all arms.
        found: what happens to the objects.
        known: pairs that hold without being listed.
    """
    by_id, latest = numbered(events), dict[str, MotionId]()
    out = []
    for second, names in found.uses:
        for first in sorted({latest[name] for name in names if name in latest}):
            pair = OrderPair(first=first, second=second, past_s=round(by_id[first].end_s - by_id[first].begin_s, 9))
            if first[0] != second[0] and not any(_implies(other, pair) for other in (*known, *out)):
                out.append(pair)
        latest |= dict.fromkeys(names, second)
    return out


def _implies(known: OrderPair, pair: OrderPair) -> bool:
    """Returns whether a pair holds because an event before the second one has waited for as much."""
    arms = known.first[0] == pair.first[0] and known.second[0] == pair.second[0]
    later = (known.first[1], known.past_s) >= (pair.first[1], pair.past_s)
    return arms and later and known.second[1] <= pair.second[1]
