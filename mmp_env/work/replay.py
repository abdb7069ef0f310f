"""Applies the events of a schedule to the objects: windows of time in which the same things lie, hang and may touch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.work.jobs import Jobs
from mmp_env.work.schedule import MotionId, WorkEvent, numbered
from mmp_env.work.trajectory import Trajectory
from mmp_env.work.world import Touching, World, first_world, grasp_contacts, support_contacts

OBJECT_EVENTS = ("grasp", "release")
"""Kinds of events that change where an object is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Window:
    """Times [s] between which `world` is true."""

    begin_s: float
    end_s: float
    world: World


@dataclass(frozen=True, kw_only=True, eq=False)
class Replay:
    """The objects over time.

    Attributes:
        windows: in their order, without gaps.
        held: event, by arm and number -> what the arm holds in it and after it; nothing for those that are left out.
        uses: grasps and releases in their order, each with its object and with the objects below that.
    """

    windows: tuple[Window, ...]
    held: Mapping[MotionId, Obstacle]
    uses: tuple[tuple[MotionId, frozenset[str]], ...] = ()


def replay(
    cell: Cell,
    jobs: Jobs,
    trajectories: Mapping[str, Trajectory],
    events: Sequence[WorkEvent],
    begins: Mapping[MotionId, float] | None = None,
) -> Replay:
    """Returns what happens to the objects.

    Args:
        cell: the arms and obstacles.
        jobs: the work.
        trajectories: arm name -> its motion.
        events: the events of all arms.
        begins: when events really begin [s], by arm and number; None if they are on time.

    Raises:
        InvalidInstanceError: if an event cannot happen, such as a grasp of an object that is elsewhere.
    """
    by_number = numbered(events)
    spans = {name: (each.begin_s, each.end_s) for name, each in by_number.items()}
    if begins is not None:
        spans = {name: (begins[name], begins[name] + end - begin) for name, (begin, end) in spans.items()}
    end = max([*(float(each.times[-1]) for each in trajectories.values()), *(until for _, until in spans.values())])
    changes = [(spans[number][0], number) for number, event in by_number.items() if event.kind in OBJECT_EVENTS]
    worlds, changed = [(0.0, first_world(cell, jobs.objects))], {}
    permits: list[tuple[float, float, Touching]] = []
    uses = []
    for time, number in sorted(changes, key=lambda change: change[0]):
        event, before = by_number[number], worlds[-1][1]
        after = happened(before, event, trajectories[event.arm].at(np.array([event.begin_s]))[0])
        worlds.append((time, after))
        changed[number] = after.held.get(event.arm)
        assert event.solid is not None
        uses.append((number, frozenset(after.concerned(event.solid.name))))
        permits += _permits(before, after, number, by_number, spans, trajectories[event.arm], end)
    cuts = {0.0, end, *(time for time, _ in worlds), *(t for first, last, _ in permits for t in (first, last))}
    windows = []
    for first, last in pairwise(sorted(cuts)):
        world = next(world for time, world in reversed(worlds) if time <= first)
        touching = [pair for a, b, pairs in permits if a <= first and last <= b for pair in pairs]
        windows.append(Window(begin_s=first, end_s=last, world=world.letting(touching)))
    if not windows:
        windows.append(Window(begin_s=0.0, end_s=end, world=worlds[-1][1]))
    return Replay(windows=tuple(windows), held=dict(_held(by_number, changed)), uses=tuple(uses))


def happened(world: World, event: WorkEvent, q: Float[np.ndarray, "dof"]) -> World:
    """Returns the world after an arm has grasped or released an object. Raises `InvalidInstanceError`."""
    arm, where = world.cell.arm(event.arm), f"step {event.step} of job '{event.job}'"
    assert event.solid is not None
    change = world.grasped if event.kind == "grasp" else world.released
    return change(arm, event.solid.name, q, where)


def windows_of(plan: Plan, found: Replay) -> Iterator[Plan]:
    """Yields the part of a plan in each window, in the cell with the objects of that window."""
    for window in found.windows:
        inside = (plan.times > window.begin_s) & (plan.times < window.end_s)
        times = np.concatenate([[window.begin_s], plan.times[inside], [window.end_s]])
        rows = {
            name: np.column_stack([np.interp(times, plan.times, column) for column in q.T])
            for name, q in plan.positions.items()
        }
        ends = [{name: q[k] for name, q in rows.items()} for k in (0, -1)]
        problem = replace(plan.problem, cell=window.world.filled, start=ends[0], goal=ends[1], goals={}, goal_asked={})
        times = times - times[0]
        yield Plan(problem=problem, times=times, positions=rows)


def _permits(
    before: World,
    after: World,
    number: MotionId,
    events: Mapping[MotionId, WorkEvent],
    spans: Mapping[MotionId, tuple[float, float]],
    trajectory: Trajectory,
    end: float,
) -> Iterator[tuple[float, float, Touching]]:
    """Yields from when to when [s] what may touch around an event: in the motion before it and in the one after it."""
    event = events[number]
    assert event.solid is not None
    arm, name = before.cell.arm(event.arm), event.solid.name
    grasp = grasp_contacts(arm, name)
    support = support_contacts(arm, after.supports[name])
    first, second = (grasp, support) if event.kind == "grasp" else (support, grasp)
    own = [name for name in events if name[0] == event.arm]
    place = own.index(number)
    moves = [trajectory.moves(events[name].begin_s, events[name].end_s) for name in own]
    begin = max((spans[own[k]][0] for k in range(place) if moves[k]), default=0.0)
    until = min((spans[own[k]][1] for k in range(place, len(own)) if moves[k]), default=end)
    yield begin, spans[number][0], first
    yield spans[number][0], until, second


def _held(
    events: Mapping[MotionId, WorkEvent], changed: Mapping[MotionId, Obstacle | None]
) -> Iterator[tuple[MotionId, Obstacle]]:
    """Yields the events in which an arm holds an object, with that object."""
    held: dict[str, Obstacle | None] = {}
    for number in events:
        arm = number[0]
        held[arm] = changed[number] if number in changed else held.get(arm)
        solid = held[arm]
        if solid is not None:
            yield number, solid
