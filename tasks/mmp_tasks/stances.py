"""Stances: configurations of all arms together that bring every tool to its place, valid and clear of each other."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.cell import Arm, Cell
from mmp_env.errors import MmpError
from mmp_env.robot import frozen_array
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.task import State

_COMPARED = 3
"""Of so many solutions that will do, the one nearest to where the arm comes from is taken."""
_TOOL_ROOM_M = 0.04
"""No other arm can be so near to a tool point, around which its own arm has some thickness."""
_LOOKED_AT = 3000
"""Choices before a search for compatible configurations is given up."""
_TILTS = tuple(np.radians([0.0, 25.0, 45.0]).tolist())


class Missed(Exception):
    """A draw that came to nothing, which is no error: the next begins. The message says at what it ended."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """Where a tool point shall be in the world [m]; `upright`: the tool points straight down, not nearly so."""

    point: Float[np.ndarray, "3"]
    upright: bool = True


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """What all tasks with inverse kinematics have in common: clearances to keep [m], and how often to try.

    `tries` solutions of inverse kinematics are looked at for one arm and place; where none will do, the whole draw
    starts anew, at most `draws` times.
    """

    clearance: float = 0.01
    static_clearance: float = 0.0025
    tries: int = 12
    draws: int = 60

    def __post_init__(self) -> None:
        for name in ("clearance", "static_clearance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise MmpError(f"{name} of a task is {value}; it must be a length in metres, 0 or more")
        for name in ("tries", "draws"):
            value = getattr(self, name)
            if value < 1:
                raise MmpError(f"{name} of a task is {value}; it must be 1 or more")

    def stance(
        self,
        cell: Cell,
        places: Mapping[str, Place],
        rng: np.random.Generator,
        near: State,
        beside: State | None = None,
    ) -> State:
        """Configurations of the arms in `places`, each with its tool at its place, near to `near`.

        They are clear of each other and of the arms `beside`, which come back with them. Raises `Missed`.
        """
        chosen = dict(beside or {})
        _refuse_filled(cell, places, chosen)
        # An arm alone takes one of the first few; among several arms it may have to make do with any.
        enough = _COMPARED if len(places) == 1 else self.tries
        found = {
            name: self._candidates(cell, cell.arm(name), place, rng, chosen, enough) for name, place in places.items()
        }
        for name, q in found.items():
            if not len(q):
                raise Missed(f"arm '{name}' ({cell.arm(name).robot.name})")
            found[name] = q[np.argsort(np.abs(q - near[name]).max(axis=1), kind="stable")]
        numbers = self._compatible(cell, found)
        return chosen | {name: frozen_array(q[numbers[name]]) for name, q in found.items()}

    def _candidates(
        self, cell: Cell, arm: Arm, place: Place, rng: np.random.Generator, beside: State, enough: int
    ) -> Float[np.ndarray, "n dof"]:
        """Up to `enough` configurations of one arm that are valid beside the arms `beside`."""
        found: list[Float[np.ndarray, " dof"]] = []
        for q in itertools.islice(_solutions(arm, place, rng), self.tries):
            if self._fits(cell, arm, q, beside):
                found.append(q)
            if len(found) == enough:
                break
        return np.array(found).reshape(-1, arm.dof)

    def _compatible(self, cell: Cell, found: Mapping[str, Float[np.ndarray, "n dof"]]) -> dict[str, int]:
        """For each arm the number of a configuration, all clear of each other, early ones rather. Raises `Missed`."""
        names = sorted(found, key=lambda name: len(found[name]))
        clear = {(a, b): self._clear(cell, (a, found[a]), (b, found[b])) for a, b in itertools.combinations(names, 2)}
        farthest, looked_at = 0, 0

        def extend(chosen: dict[str, int]) -> dict[str, int] | None:
            nonlocal farthest, looked_at
            if len(chosen) == len(names):
                return chosen
            farthest = max(farthest, len(chosen))
            name = names[len(chosen)]
            fits = np.all([clear[a, name][k] for a, k in chosen.items()] or [np.ones(len(found[name]), bool)], axis=0)
            for number in np.flatnonzero(fits).tolist():
                looked_at += 1
                if looked_at > _LOOKED_AT:
                    return None
                if out := extend(chosen | {name: number}):
                    return out
            return None

        out = extend({})
        if out is None:
            raise Missed(f"arm '{names[farthest]}' ({cell.arm(names[farthest]).robot.name})")
        return out

    def _clear(
        self, cell: Cell, one: tuple[str, Float[np.ndarray, "n dof_a"]], other: tuple[str, Float[np.ndarray, "m dof_b"]]
    ) -> Bool[np.ndarray, "n m"]:
        """Which configurations of two arms are clear of each other."""
        (a, q_a), (b, q_b) = one, other
        rows = np.repeat(q_a, len(q_b), axis=0), np.tile(q_b, (len(q_a), 1))
        apart = cell.collision.pair_clearance(a, rows[0], b, rows[1], precise=True)
        return (apart >= self.clearance).reshape(len(q_a), len(q_b))

    def require(self, cell: Cell, state: State, which: str) -> State:
        """`state` itself. Raises `Missed` where it does not keep the clearances in the cell."""
        drawn: dict[str, Float[np.ndarray, " dof"]] = {}
        for arm in cell.arms:
            if not self._fits(cell, arm, state[arm.name], drawn):
                raise Missed(f"arm '{arm.name}' ({arm.robot.name}) {which}")
            drawn[arm.name] = state[arm.name]
        return state

    def _fits(self, cell: Cell, arm: Arm, q: Float[np.ndarray, " dof"], drawn: State) -> bool:
        queries = cell.collision
        if not queries.within_limits(arm.name, [q])[0]:
            return False
        if queries.static_clearance(arm.name, [q], precise=True)[0] < self.static_clearance:
            return False
        return all(
            queries.pair_clearance(arm.name, [q], other, [q_other], precise=True)[0] >= self.clearance
            for other, q_other in drawn.items()
        )


def gave_up(task: str, cell: Cell, draws: int, misses: Counter[str]) -> MmpError:
    """The error of a task whose draws all came to nothing."""
    hardest, times = misses.most_common(1)[0]
    return MmpError(
        f"task '{task}' found no instance for cell '{cell.name}' in {draws} draws: {times} of them ended at {hardest}"
    )


def tucked(cell: Cell) -> State:
    """Every arm in the tucked pose of its robot."""
    return {arm.name: arm.robot.tucked for arm in cell.arms}


def home(cell: Cell) -> State:
    """Every arm in the home pose of its robot."""
    return {arm.name: arm.robot.home for arm in cell.arms}


def _refuse_filled(cell: Cell, places: Mapping[str, Place], drawn: State) -> None:
    """Raises `Missed` where an arm stands in the place of a tool: that is seen sooner than found out."""
    for other, q in drawn.items():
        centers, radii = cell.collision.spheres(other, [q])
        for name, place in places.items():
            if (np.linalg.norm(centers[0] - place.point, axis=1) - radii).min() < _TOOL_ROOM_M:
                raise Missed(f"arm '{name}' ({cell.arm(name).robot.name})")


def _solutions(arm: Arm, place: Place, rng: np.random.Generator) -> Iterator[Float[np.ndarray, " dof"]]:
    """With the tool straight down first; what cannot be reached so, with the tool tilted away from the base."""
    T_base_world = np.linalg.inv(arm.T_world_base)
    point = T_base_world[:3, :3] @ place.point + T_base_world[:3, 3]
    outward = (place.point - arm.position) * [1.0, 1.0, 0.0]
    outward /= max(float(np.linalg.norm(outward)), 1e-9)
    solver = kinematics(arm.robot, arm.tool)
    for tilt in _TILTS[:1] if place.upright else _TILTS:
        direction = np.array([0.0, 0.0, -np.cos(tilt)]) + np.sin(tilt) * outward
        yield from solver.solutions(point, T_base_world[:3, :3] @ direction, rng)
