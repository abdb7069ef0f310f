"""The objects of a schedule: what each grasp and release does, and whether it can."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from mmp_env.check.checked import CheckedArm, Solid
from mmp_env.check.fields import rotation
from mmp_env.check.held import BODY, holders
from mmp_env.check.lines import tool_pose
from mmp_env.check.report import Violation
from mmp_env.check.resting import carriers, corners
from mmp_env.check.work import Event, Work
from mmp_env.mujoco_import import mujoco

GRASP_TOLERANCE_M = 0.01
"""Largest distance of the tool point, or of the flange without a tool, from an object that is grasped [m]."""
SAME_POSE = 1e-5
"""Largest difference of the pose of an object in an event from the one that follows from the motions [m or rad]."""
OBJECT_KINDS = ("grasp", "release")
"""Kinds of events that handle objects."""
_ROOM_M = 1e-6
"""Room for rounding [m]."""
Pair = tuple[str, str]
"""A part of an arm, such as `arm0/held`, and the solid that it may touch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """Where objects are: `lying` object -> solid; `held` arm -> solid in the frame of its tool; what carries them."""

    lying: Mapping[str, Solid]
    held: Mapping[str, Solid] = field(default_factory=dict)
    under: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class Use:
    """A grasp or release: its event, its number among those of the arm, and the objects concerned."""

    event: Event
    index: int
    names: frozenset[str]


@dataclass(frozen=True, kw_only=True, eq=False)
class Hold:
    """An arm holds a solid, in the frame of its tool, from an event (by number) until another; None: to the end."""

    arm: str
    first: int
    until: int | None
    solid: Solid


@dataclass(frozen=True, kw_only=True, eq=False)
class ObjectWindow:
    """A window [s] in which the same objects lie and hang, and the same pairs may touch."""

    begin: float
    end: float
    state: State
    touching: frozenset[Pair]


@dataclass(kw_only=True, eq=False)
class Handled:
    """Holds the consequences of all grasps and releases."""

    states: list[tuple[float, State]]
    uses: list[Use] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    permits: list[tuple[float, float, frozenset[Pair]]] = field(default_factory=list)
    faults: list[Violation] = field(default_factory=list)


def handle(work: Work, objects: Sequence[Solid]) -> Handled:
    """Returns what the grasps and releases do, up to the first one that is wrong."""
    lying = {solid.name: solid for solid in objects}
    under = {name: tuple(carriers(solid, _solids(work, lying, name))) for name, solid in lying.items()}
    out = Handled(states=[(0.0, State(lying=lying, under=under))])
    for name in lying:
        if not under[name]:
            out.faults.append(
                Violation(rule="objects", message=f"nothing carries object '{name}' at the begin, so it would fall")
            )
    events = [event for event in work.events if event.kind in OBJECT_KINDS]
    for event in sorted(events, key=lambda each: each.begin):
        if out.faults:
            return out
        before = out.states[-1][1]
        arm = next(arm for arm in work.cell.arms if arm.name == event.arm)
        change = _grasped if event.kind == "grasp" else _released
        after = change(work, arm, event, before, out)
        if after is None:
            return out
        out.states.append((event.begin, after))
        index = work.of_arm(arm.name).index(event)
        assert event.object is not None
        below = (name for name in after.under[event.object] if name in after.under)
        out.uses.append(Use(event=event, index=index, names=frozenset((event.object, *below))))
        out.permits += _permits(work, arm, event, index, after)
        if event.kind == "grasp":
            out.holds.append(Hold(arm=arm.name, first=index, until=None, solid=after.held[arm.name]))
        else:
            k = max(k for k, hold in enumerate(out.holds) if hold.arm == arm.name)
            out.holds[k] = replace(out.holds[k], until=index)
    return out


def windows(handled: Handled, end: float) -> list[ObjectWindow]:
    """Returns the windows from 0 to the end of a schedule [s]."""
    cuts = {0.0, end, *(time for time, _ in handled.states)}
    cuts |= {time for begin, until, _ in handled.permits for time in (begin, until)}
    times = sorted(cuts)
    if len(times) == 1:  # nothing moves, and a window of any length says so
        times.append(times[0] + 1.0)
    out = []
    for begin, until in pairwise(times):
        state = [state for time, state in handled.states if time <= begin][-1]
        touching = [pairs for a, b, pairs in handled.permits if a <= begin and until <= b]
        out.append(ObjectWindow(begin=begin, end=until, state=state, touching=frozenset().union(*touching)))
    return out


def pose_at(
    work: Work, arm: CheckedArm, times: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3 3"]]:
    """Returns the frames of a tool at times [s]: origins [m] and rotations."""
    first = sum(other.dof for other in work.cell.arms[: [each.name for each in work.cell.arms].index(arm.name)])
    q = np.zeros(sum(each.dof for each in work.cell.arms))
    rows = []
    for row in work.motions[arm.name].at(times):
        q[first : first + arm.dof] = row
        rows.append(tool_pose(work.model, arm, q))
    return np.array([p for p, _ in rows]), np.array([r for _, r in rows])


def _grasped(work: Work, arm: CheckedArm, event: Event, state: State, out: Handled) -> State | None:
    name, where = event.object or "", _where(event)
    if arm.name in state.held or arm.held is not None:
        held = state.held.get(arm.name, arm.held)
        return _refuse(out, event, f"{where} grasps '{name}', but arm '{arm.name}' holds '{held.name if held else ''}'")
    if name not in state.lying:
        holder = next((a for a, solid in state.held.items() if solid.name == name), None)
        return _refuse(out, event, f"{where} grasps '{name}', which {'arm ' + holder if holder else 'nobody'} holds")
    solid = state.lying[name]
    origins, turns = pose_at(work, arm, np.array([event.begin]))
    origin, turn = origins[0], turns[0]
    point = origin + (turn @ np.array(arm.tool.data["point"], dtype=float) if arm.tool else 0.0)
    gap_m = _distance(solid, point)
    if gap_m > GRASP_TOLERANCE_M + _ROOM_M:
        return _refuse(out, event, f"{where} grasps '{name}', which is {gap_m:.3g} m from the tool of arm '{arm.name}'")
    if above := [other for other, under in state.under.items() if name in under and other in state.lying]:
        return _refuse(out, event, f"{where} grasps '{name}', on which '{above[0]}' lies")
    if not _same(event, solid):
        return _refuse(out, event, f"{where} grasps '{name}' at another pose than the motions before brought it to")
    local = replace(
        solid,
        position=turn.T @ (solid.position - origin),
        quaternion=_quaternion(turn.T @ rotation(solid.quaternion)),
    )
    lying = {other: each for other, each in state.lying.items() if other != name}
    return State(lying=lying, held=dict(state.held) | {arm.name: local}, under=state.under)


def _released(work: Work, arm: CheckedArm, event: Event, state: State, out: Handled) -> State | None:
    name, where = event.object or "", _where(event)
    held = state.held.get(arm.name)
    if held is None or held.name != name:
        return _refuse(out, event, f"{where} releases '{name}', which arm '{arm.name}' does not hold")
    origins, turns = pose_at(work, arm, np.array([event.begin]))
    solid = placed(held, origins[0], turns[0])
    found = carriers(solid, _solids(work, state.lying, name))
    if not found:
        return _refuse(out, event, f"{where} releases '{name}' where nothing carries it, so it would fall")
    if not _same(event, solid):
        return _refuse(out, event, f"{where} releases '{name}' at another pose than the motion brought it to")
    rest = {other: each for other, each in state.held.items() if other != arm.name}
    return State(lying=dict(state.lying) | {name: solid}, held=rest, under=dict(state.under) | {name: tuple(found)})


def placed(held: Solid, origin: Float[np.ndarray, "3"], turn: Float[np.ndarray, "3 3"]) -> Solid:
    """Returns a held solid in the world, with the frame of its tool at a pose."""
    return replace(
        held, position=origin + turn @ held.position, quaternion=_quaternion(turn @ rotation(held.quaternion))
    )


def _permits(
    work: Work, arm: CheckedArm, event: Event, index: int, after: State
) -> Iterator[tuple[float, float, frozenset[Pair]]]:
    """Yields what may touch in the motion before a grasp or release, and in the one after it."""
    events, motion, name = work.of_arm(arm.name), work.motions[arm.name], event.object or ""
    moves = [motion.moves(each.begin, each.end) for each in events]
    begin = max((events[k].begin for k in range(index) if moves[k]), default=0.0)
    last = max(float(each.times[-1]) for each in work.motions.values())
    until = min((events[k].end for k in range(index, len(events)) if moves[k]), default=last)
    grasp = frozenset((f"{arm.name}/{part}", name) for part in holders(arm))
    support = frozenset((f"{arm.name}/{BODY}", solid) for solid in after.under[name])
    first, second = (grasp, support) if event.kind == "grasp" else (support, grasp)
    yield begin, event.begin, first
    yield event.begin, until, second


def _solids(work: Work, lying: Mapping[str, Solid], but: str) -> list[Solid]:
    return [*work.cell.solids, *(solid for name, solid in lying.items() if name != but)]


def _distance(solid: Solid, point: Float[np.ndarray, "3"]) -> float:
    """Returns the distance of a point from a solid that is no mesh [m]."""
    local = np.abs(rotation(solid.quaternion).T @ (point - solid.position))
    if solid.shape == "box":
        return float(np.linalg.norm(np.maximum(local - solid.size, 0.0)))
    across, along = float(np.linalg.norm(local[:2])), float(local[2])
    radius, half = float(solid.size[0]), float(solid.size[1])
    if solid.shape == "cylinder":
        return float(np.linalg.norm([max(across - radius, 0.0), max(along - half, 0.0)]))
    return max(float(np.linalg.norm([across, max(along - half, 0.0)])) - radius, 0.0)


def _same(event: Event, solid: Solid) -> bool:
    if event.pose is None:
        return False
    position, quaternion = event.pose
    turn = rotation(quaternion).T @ rotation(solid.quaternion)
    return bool(np.abs(position - solid.position).max() <= SAME_POSE and np.abs(turn - np.eye(3)).max() <= SAME_POSE)


def _quaternion(turn: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    out = np.empty(4)
    mujoco.mju_mat2Quat(out, np.ascontiguousarray(turn).ravel())
    return out


def _where(event: Event) -> str:
    return f"step {event.step} of job '{event.job}'"


def _refuse(out: Handled, event: Event, message: str) -> None:
    out.faults.append(Violation(rule="objects", message=message, time_s=event.begin, arms=(event.arm,)))


def lowest(
    solid: Solid, origins: Float[np.ndarray, "n 3"], turns: Float[np.ndarray, "n 3 3"]
) -> Float[np.ndarray, "n"]:
    """Returns the height of the lowest point of a held solid, with the frame of its tool at poses [m]."""
    points, grown = corners(solid)
    return (np.einsum("nj,kj->nk", turns[:, 2], points) + origins[:, 2, None]).min(axis=1) - grown
