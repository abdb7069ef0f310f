"""Turns what was asked for into configurations: candidates of every arm, and a combination that is free together."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from mmp_env.errors import InvalidInstanceError
from mmp_env.model.cell import Cell
from mmp_env.model.goals import Goal, JointGoal
from mmp_env.model.margins import KINDS, MOST_SLACK_M, NO_MARGINS, Margins, millimetres
from mmp_env.problems.candidates import (
    Candidates,
    are_free_alone,
    candidates,
    in_collision,
    not_upright,
    what_blocks,
)
from mmp_env.problems.combinations import Combinations
from mmp_env.wording import how_far_apart

_ROOM_M = MOST_SLACK_M / 0.9
"""Clearance [m] beyond the margins that candidates have if enough of them do: planners plan faster with their slack."""
_HALVINGS = 16


@dataclass(frozen=True, kw_only=True, eq=False)
class Resolved:
    """Configurations that were found.

    Attributes:
        chosen: arm name -> [dof] [rad], free together but for configurations that were given.
        candidates: arm name -> [n, dof] [rad], each free alone but for configurations that were given.
        margins: margins that the candidates keep.
    """

    chosen: Mapping[str, Float[np.ndarray, "dof"]]
    candidates: Mapping[str, Float[np.ndarray, "n dof"]]
    margins: Margins


def resolve(
    cell: Cell,
    asked: Mapping[str, Goal],
    near: Mapping[str, Float[np.ndarray, "dof"]],
    margins: Margins,
    required: Mapping[str, float],
    which: str,
) -> Resolved:
    """Returns configurations for what was asked for, with a preference for those near to given ones.

    A configuration that was given is taken as it is, free or not. Candidates have 1.1 mm of clearance beyond the
    margins where a combination of such candidates is free together; otherwise the margins alone. A margin that was not
    asked for may be smaller where there is no other choice.

    Args:
        cell: arms and obstacles.
        asked: arm name -> what was asked for.
        near: arm name -> [dof] [rad]: preferred configurations.
        margins: the margins that the configurations keep.
        required: kind -> the margins [m] that were asked for.
        which: `start` or `goal`, for messages.

    Raises:
        InvalidInstanceError: if there is no such combination, with the reason.
    """
    words = {arm.name: f"{which} of arm '{arm.name}'" for arm in cell.arms}
    found = {arm.name: candidates(arm, asked[arm.name], near[arm.name], words[arm.name]) for arm in cell.arms}
    least = Margins(**{kind: required.get(kind, 0.0) for kind in KINDS}) if required else NO_MARGINS
    for kept, room in ((margins, _ROOM_M), (margins, 0.0), (least, 0.0)):
        free = {
            arm.name: every
            if isinstance(asked[arm.name], JointGoal)
            else every.take(are_free_alone(cell, arm, every.q, kept, room))
            for arm in cell.arms
            for every in (found[arm.name],)
        }
        if all(map(len, free.values())):
            chosen = Combinations(cell, free, kept.arms + room).first()
            if chosen is not None:
                return Resolved(
                    chosen={name: free[name].q[k] for name, k in chosen.items()},
                    candidates={name: every.q for name, every in free.items()},
                    margins=kept,
                )
    for arm in cell.arms:
        if not len(free[arm.name]):
            rows = found[arm.name].q
            if (
                arm.name in cell.keep
                and (tilts := cell.collision.tilt(arm.name, rows)).min() > cell.keep[arm.name].within
            ):
                raise not_upright(words[arm.name], float(tilts.min()), cell.keep[arm.name])
            hint = _largest(
                required, lambda kept, arm=arm, rows=rows: bool(are_free_alone(cell, arm, rows, kept, 0.0).any())
            )
            raise in_collision(words[arm.name], len(rows), what_blocks(cell, arm, rows, least) + hint)

    def are_free_together(kept: Margins) -> bool:
        free = {arm.name: found[arm.name] for arm in cell.arms}
        for arm in cell.arms:
            if not isinstance(asked[arm.name], JointGoal):
                free[arm.name] = free[arm.name].take(are_free_alone(cell, arm, free[arm.name].q, kept, 0.0))
        return all(map(len, free.values())) and Combinations(cell, free, kept.arms).first() is not None

    raise InvalidInstanceError(_why_not_together(cell, free, least.arms, which) + _largest(required, are_free_together))


def _largest(required: Mapping[str, float], works: Callable[[Margins], bool]) -> str:
    """Returns words for the largest margins with which a test works, in proportion to those that were asked for.

    The words are empty if no margins were asked for, or none would do.
    """

    def scaled(share: float) -> Margins:
        return Margins(**{kind: share * required.get(kind, 0.0) for kind in KINDS})

    if not any(required.values()) or not works(scaled(0.0)):
        return ""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if works(scaled(middle)) else (low, middle)
    if len(set(required.values())) == 1:
        return f"; the largest margin that would do is {millimetres(low * max(required.values()))} mm"
    return f"; margins of {math.floor(100 * low)}% of those asked for would do"


def keeping(
    cell: Cell, resolved: Resolved, asked: Mapping[str, Goal], margins: Margins
) -> Mapping[str, Float[np.ndarray, "n dof"]]:
    """Returns the candidates that keep the margins of the problem, which may be larger, and those that are chosen.

    Args:
        cell: arms and obstacles.
        resolved: what was found.
        asked: arm name -> what was asked for.
        margins: the margins of the problem.
    """
    if all(margins[kind] <= resolved.margins[kind] for kind in KINDS):
        return resolved.candidates
    out = dict(resolved.candidates)
    for arm in cell.arms:
        rows = out[arm.name]
        if not isinstance(asked[arm.name], JointGoal):
            chosen = (rows == resolved.chosen[arm.name]).all(axis=1)
            out[arm.name] = rows[chosen | are_free_alone(cell, arm, rows, margins, 0.0)]
    return out


def _why_not_together(cell: Cell, free: Mapping[str, Candidates], clearance: float, which: str) -> str:
    pair = Combinations(cell, free, clearance).blocked_pair()
    if pair is None:
        return (
            f"the arms cannot all be at their {which}s: any two of them can, but no combination of their"
            f" configurations that was tried is free"
        )
    a, b = pair.names
    two = replace(cell, arms=(cell.arm(a), cell.arm(b)), obstacles=(), joints=None, keep={})
    near = two.collision.nearest({a: free[a].q[pair.best[0]], b: free[b].q[pair.best[1]]})["arms"]
    apart = how_far_apart(near.clearance_m)
    return (
        f"arms '{a}' and '{b}' cannot both be at their {which}s; where they are farthest apart, the closest pair is"
        f" {near.bodies} ({apart})"
    )
