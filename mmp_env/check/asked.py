"""Reads the goals of each arm: poses and configurations, any of which will do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.fields import LARGEST_M, UnreadableError, known, listed, member, numbers, rotation, shown

_MOST_GOALS, _DEEPEST = 1000, 10
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class AskedPose:
    """A pose of the tool in the world: `position` [m], and `turn` unless all rotation is free.

    `about_z`: whether the rotation about z of the tool is free.
    """

    position: Float[np.ndarray, "3"]
    turn: Float[np.ndarray, "3 3"] | None
    about_z: bool

    def off(self, position: Float[np.ndarray, "3"], turn: Float[np.ndarray, "3 3"]) -> tuple[float, float]:
        """Returns how far [m] and by what angle [rad] a pose is off."""
        distance = float(np.linalg.norm(position - self.position))
        if self.turn is None:
            return distance, 0.0
        if self.about_z:
            here, there = turn @ _UP, self.turn @ _UP
            return distance, float(np.arctan2(np.linalg.norm(np.cross(here, there)), here @ there))
        rest = self.turn.T @ turn
        sine = np.linalg.norm([rest[2, 1] - rest[1, 2], rest[0, 2] - rest[2, 0], rest[1, 0] - rest[0, 1]]) / 2
        return distance, float(np.arctan2(sine, (np.trace(rest) - 1) / 2))


Asked = Sequence[AskedPose | Float[np.ndarray, "dof"]]
"""Poses and configurations [rad or m] of which any will do."""


def read_asked(data: Any, named: Mapping[str, Mapping[str, Float[np.ndarray, "dof"]]]) -> dict[str, Asked]:
    """Returns arm name -> what was asked for. Raises `UnreadableError`.

    Args:
        data: `goal_asked` of the file.
        named: arm name -> name -> configuration [dof] [rad or m].
    """
    known(data, tuple(named), "goal_asked")
    return {
        arm: _alternatives(member(data, arm, "goal_asked"), configurations, f"goal_asked.{arm}")
        for arm, configurations in named.items()
    }


def _alternatives(data: Any, named: Mapping[str, Float[np.ndarray, "dof"]], where: str, depth: int = 0) -> Asked:
    if isinstance(data, str):
        if data not in named:
            raise UnreadableError(f"{where} is {shown(data)}; known: {', '.join(named)}")
        return [named[data]]
    if not isinstance(data, Mapping):
        return [numbers(data, next(iter(named.values())).shape, where)]
    known(data, ("pose", "any"), where)
    if len(data) != 1:
        raise UnreadableError(f"{where} has a pose and any, or neither; it must be one of them")
    if "pose" in data:
        return [_pose(member(data, "pose", where), f"{where}.pose")]
    several = listed(data, "any", where)
    if depth > _DEEPEST or not 1 <= len(several) <= _MOST_GOALS:
        raise UnreadableError(f"{where} has {len(several)} goals at depth {depth}; 1 to {_MOST_GOALS} can be read")
    return [goal for each in several for goal in _alternatives(each, named, f"{where}.any", depth + 1)]


def _pose(data: Any, where: str) -> AskedPose:
    known(data, ("position", "quaternion", "free"), where)
    free, position = data.get("free"), numbers(member(data, "position", where), (3,), f"position of {where}")
    if free not in (None, "z", "rotation"):
        raise UnreadableError(f"free of {where} is {shown(free)}; known: z, rotation")
    if not (np.abs(position) <= LARGEST_M).all():
        raise UnreadableError(f"position of {where} must be numbers within {LARGEST_M:g} m")
    if free == "rotation":
        return AskedPose(position=position, turn=None, about_z=False)
    wxyz = numbers(member(data, "quaternion", where), (4,), f"quaternion of {where}")
    largest = float(np.abs(wxyz).max())
    if not (np.isfinite(largest) and largest > 0):
        raise UnreadableError(f"quaternion of {where} must be finite numbers that are not all zero")
    unit = wxyz / largest
    return AskedPose(position=position, turn=rotation(unit / np.linalg.norm(unit)), about_z=free == "z")
