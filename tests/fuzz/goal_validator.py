"""Nonsense in configurations, goals and bounds on tool axes, by docs/reference/files.md#goals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from fuzz.json_values import is_direction, is_number, is_vector, missing

WORDS = ("home", "tucked")
"""Configurations that each robot has."""
FREE = ("z", "rotation")
"""Rotations that a pose may leave free."""
LEAST_ANGLE, MOST_ANGLE = 0.001, math.pi / 2 + 1e-9
"""Smallest and largest angle of a bound on a tool axis [rad]."""


def ends_nonsense(
    value: Any, joints: Mapping[str, int | None], *, is_start: bool, are_all: bool = True
) -> Iterator[str]:
    """Yields what is wrong with the goals of the arms; `joints` are those of each arm. Without any, all are known."""
    what = "start" if is_start else "goal"
    if not isinstance(value, dict):
        yield f"a {what} that is no object"
        return
    if are_all:
        yield from (f"a {what} without the arm {arm}" for arm in joints if arm not in value)
    for arm, goal in value.items():
        yield from goal_nonsense(goal, joints.get(arm), is_start=is_start)


def goal_nonsense(goal: Any, joints: int | None, *, is_start: bool) -> Iterator[str]:
    """Yields what is wrong with the goal of an arm with this number of joints, if it is known."""
    if isinstance(goal, list):
        if not is_vector(goal, joints):
            yield f"a configuration {str(goal)[:60]}"
    elif isinstance(goal, dict) and list(goal) == ["pose"]:
        yield from _pose_nonsense(goal["pose"])
    elif isinstance(goal, dict) and list(goal) == ["any"] and not is_start:
        if not isinstance(goal["any"], list) or not goal["any"]:
            yield f"any {goal['any']}"
            return
        for each in goal["any"]:
            yield from goal_nonsense(each, joints, is_start=is_start)
    elif not isinstance(goal, str) or goal not in (WORDS if is_start else (*WORDS, "stay")):
        yield f"a {'start' if is_start else 'goal'} {str(goal)[:60]}"


def configurations_nonsense(what: str, value: Any, joints: Mapping[str, int | None]) -> Iterator[str]:
    """Yields what is wrong with one configuration for each arm."""
    if not isinstance(value, dict) or (joints and set(value) != set(joints)):
        yield f"{what} of other arms"
        return
    for arm, row in value.items():
        if not is_vector(row, joints.get(arm)):
            yield f"a {what} {str(row)[:60]}"


def bounds_nonsense(value: Any) -> Iterator[str]:
    """Yields what is wrong with bounds on the tool axes of some arms."""
    if not isinstance(value, dict):
        yield "a bound of no arm"
        return
    for bound in value.values():
        yield from bound_nonsense(bound)


def bound_nonsense(bound: Any) -> Iterator[str]:
    """Yields what is wrong with a bound on the tool axis of one arm."""
    upright = bound.get("upright") if isinstance(bound, dict) else None
    if not isinstance(upright, dict):
        yield "a bound without an object upright"
        return
    yield from missing(upright, "axis", "within")
    if not is_direction(upright.get("axis", [0, 0, 1])):
        yield f"axis {upright['axis']}"
    if not is_number(upright.get("within", 1), LEAST_ANGLE, MOST_ANGLE):
        yield f"within {upright['within']}"


def _pose_nonsense(pose: Any) -> Iterator[str]:
    if not isinstance(pose, dict):
        yield "a pose that is no object"
        return
    if not is_vector(pose.get("position"), 3):
        yield f"the position {pose.get('position')} of a pose"
    free = pose.get("free")
    if free is not None and free not in FREE:
        yield f"free {free}"
    turn = pose.get("quaternion")
    if turn is None and free != "rotation":
        yield "a pose without quaternion"
    if turn is not None and not (is_vector(turn, 4) and any(turn)):
        yield f"quaternion {turn}"
