"""Goals of an arm: a configuration, a pose of the tool, a named configuration, its start, or any of several goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, refused, text
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.ik.freedom import FREE
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import frozen_array
from mmp_env.wording import shown

NAMED = ("home", "tucked")
"""Named configurations of every robot."""
STAY = "stay"
FARTHEST_M = 1e6
"""Largest coordinate [m] of a pose, as of everything in a cell."""
MOST_GOALS = 1000
"""Largest number of goals of an `AnyOf`."""
DEEPEST = 8
"""Largest number of `AnyOf` in one another."""
GOAL_FORMS = 'a list of joint angles, "home", "tucked", "stay", or an object with "pose" or "any"'
"""Words for the forms of a goal."""


@dataclass(frozen=True, eq=False, init=False)
class JointGoal(ReadOnly):
    """A configuration `q` [dof] [rad, slides in m]."""

    q: Float[np.ndarray, "dof"]

    def __init__(self, q: ArrayLike) -> None:
        object.__setattr__(self, "q", _finite(q, None, "the configuration of a JointGoal"))


@dataclass(frozen=True, eq=False, init=False)
class PoseGoal(ReadOnly):
    """A pose of the tool frame in the world; of the flange without a tool.

    Attributes:
        position: origin of the tool frame [3] [m].
        quaternion: rotation of the tool frame (wxyz), of any length above 0. None only if the rotation is free.
        free: `z` leaves the rotation about the tool's z axis free, `rotation` the whole rotation; None neither.

    Raises:
        MmpError: for numbers that are not finite, a zero quaternion, or a quaternion that is missing.
        UnknownNameError: for another word in `free`.
    """

    position: Float[np.ndarray, "3"]
    quaternion: Float[np.ndarray, "4"] | None
    free: Literal["z", "rotation"] | None

    def __init__(self, position: ArrayLike, quaternion: ArrayLike | None = None, free: str | None = None) -> None:
        object.__setattr__(self, "position", _finite(position, 3, "the position of a pose"))
        if np.abs(self.position).max() > FARTHEST_M:
            raise refused("the position of a pose", position, f"3 numbers of metres, {FARTHEST_M:g} at most")
        if free is not None and free not in FREE:
            raise UnknownNameError("freedom of a pose", free if isinstance(free, str) else shown(free), FREE)
        object.__setattr__(self, "free", free)
        if quaternion is None and free != "rotation":
            raise MmpError('a pose has no quaternion; only "free": "rotation" allows that')
        object.__setattr__(self, "quaternion", None if quaternion is None else _unit(quaternion))


@dataclass(frozen=True)
class NamedGoal:
    """A named configuration of the robot: `home` or `tucked`. Raises `UnknownNameError` for another name."""

    name: str

    def __post_init__(self) -> None:
        if text("name of a configuration", self.name) not in NAMED:
            raise UnknownNameError("named configuration", shown(self.name)[1:-1], (*NAMED, STAY))


@dataclass(frozen=True)
class Stay:
    """The start of the arm: it may move aside, and comes back."""


@dataclass(frozen=True, eq=False, init=False)
class AnyOf:
    """Any of several goals. The planner chooses.

    Attributes:
        goals: the goals.
        count: number of goals in it that are no `AnyOf`.
        depth: number of `AnyOf` in one another, itself included.

    Raises:
        MmpError: for what is no list of goals, no goal, more than 1000, and more than 8 `AnyOf` in one another.
    """

    goals: tuple[Goal, ...]
    count: int
    depth: int

    def __init__(self, goals: Iterable[GivenGoal]) -> None:
        if isinstance(goals, str | Mapping) or not isinstance(goals, Iterable) or _is_scalar(goals):
            raise refused("goals", goals, "a list of goals")
        object.__setattr__(self, "goals", tuple(as_goal(goal, "a goal in AnyOf") for goal in goals))
        inner = [goal for goal in self.goals if isinstance(goal, AnyOf)]
        object.__setattr__(self, "count", len(self.goals) - len(inner) + sum(goal.count for goal in inner))
        object.__setattr__(self, "depth", 1 + max((goal.depth for goal in inner), default=0))
        if not 1 <= self.count <= MOST_GOALS:
            raise MmpError(f"any of {self.count} goals; it needs at least one, and {MOST_GOALS} at most")
        if self.depth > DEEPEST:
            raise MmpError(f"any of goals is nested {self.depth} times; {DEEPEST} is the most")


def _is_scalar(value: object) -> bool:
    """Returns whether the value is a NumPy array of a single number. It counts as `Iterable`, but has no elements."""
    return isinstance(value, np.ndarray) and value.ndim == 0


Goal: TypeAlias = JointGoal | PoseGoal | NamedGoal | Stay | AnyOf
"""A goal of one arm."""
GivenGoal: TypeAlias = Goal | ArrayLike | str | Mapping[str, Any]
"""A goal in any form that `as_goal` reads."""


def as_goal(given: GivenGoal, where: str, *, depth: int = 0) -> Goal:
    """Returns the goal that is given as an object, as numbers, or in the form of JSON (docs/reference/files.md).

    Args:
        given: a `Goal`; numbers [dof] [rad]; `home`, `tucked`, `stay`; or a mapping with `pose` or `any`.
        where: begin of the messages, such as `goal of arm 'left'`.
        depth: number of goals around this one.

    Raises:
        MmpError: for anything else, with the value.
    """
    if isinstance(given, JointGoal | PoseGoal | NamedGoal | Stay | AnyOf):
        return given
    if depth > DEEPEST:
        raise MmpError(f"{where} is nested deeper than {DEEPEST} levels")
    try:
        if isinstance(given, str):
            return Stay() if given == STAY else NamedGoal(given)
        if isinstance(given, Mapping):
            return _from_mapping(given, where, depth)
    except UnknownNameError as error:
        raise MmpError(f"{where}: {error}") from None
    numbers = as_numbers(given)
    if numbers is None or numbers.ndim != 1 or isinstance(given, bool):
        raise refused(where, given, GOAL_FORMS)
    return JointGoal(numbers)


def goal_to_data(goal: Goal) -> Any:
    """Returns the form of JSON of a goal."""
    match goal:
        case JointGoal():
            return goal.q.tolist()
        case NamedGoal():
            return goal.name
        case Stay():
            return STAY
        case AnyOf():
            return {"any": [goal_to_data(each) for each in goal.goals]}
        case PoseGoal():
            pose: dict[str, Any] = {"position": goal.position.tolist()}
            if goal.quaternion is not None:
                pose["quaternion"] = goal.quaternion.tolist()
            return {"pose": pose | ({} if goal.free is None else {"free": goal.free})}


def flat(goal: Goal) -> tuple[JointGoal | PoseGoal | NamedGoal | Stay, ...]:
    """Returns the goals of which any will do, without an `AnyOf`."""
    return tuple(each for part in goal.goals for each in flat(part)) if isinstance(goal, AnyOf) else (goal,)


def _from_mapping(given: Mapping[str, Any], where: str, depth: int) -> Goal:
    if set(given) == {"any"} and isinstance(given["any"], Sequence) and not isinstance(given["any"], str):
        if not 1 <= len(given["any"]) <= MOST_GOALS:
            raise MmpError(
                f"{where}.any has {len(given['any'])} goals; it needs at least one, and {MOST_GOALS} at most"
            )
        return AnyOf(tuple(as_goal(each, f"{where}.any[{k}]", depth=depth + 1) for k, each in enumerate(given["any"])))
    if set(given) != {"pose"} or not isinstance(given["pose"], Mapping):
        raise refused(where, dict(given), GOAL_FORMS)
    pose, fields = given["pose"], ("position", "quaternion", "free")
    for name in pose:
        if name not in fields:
            raise UnknownNameError("field of a pose", shown(name)[1:-1], fields)
    if "position" not in pose:
        raise MmpError(f"{where}.pose has no position; it must be [x, y, z] in metres")
    try:
        return PoseGoal(**pose)
    except UnknownNameError:
        raise
    except MmpError as error:
        raise MmpError(f"{where}: {error}") from None


def _unit(quaternion: ArrayLike) -> Float[np.ndarray, "4"]:
    wxyz = _finite(quaternion, 4, "the quaternion of a pose")
    if not wxyz.any():
        raise MmpError("the quaternion of a pose is [0, 0, 0, 0], which is no rotation; [1, 0, 0, 0] turns nothing")
    scaled = wxyz / np.abs(wxyz).max()  # squares of tiny or huge numbers would vanish or overflow
    return frozen_array(scaled / np.linalg.norm(scaled))


def _finite(given: ArrayLike | None, count: int | None, what: str) -> Float[np.ndarray, "n"]:
    """Returns the numbers, read-only. Raises `MmpError` unless they are `count` finite numbers."""
    numbers = None if given is None else as_numbers(given)
    if numbers is None or numbers.ndim != 1 or (count is not None and len(numbers) != count):
        raise refused(what, given, f"{'a list of' if count is None else count} numbers")
    if not np.isfinite(numbers).all():
        raise refused(what, given, "finite numbers")
    return frozen_array(numbers)
