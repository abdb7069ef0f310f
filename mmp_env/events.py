"""Events of a planner for its watcher. Planners are silent otherwise, and watching changes no plan.

Arrays in events belong to the planner: watchers must not change them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.brief import brief
from mmp_env.wording import counted


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Event:
    """Base of all events.

    Attributes:
        elapsed_s: time since the start of planning [s].
    """

    elapsed_s: float

    @brief
    def __repr__(self) -> str:
        return ", ".join(f"{field.name}={_short(getattr(self, field.name))}" for field in fields(self))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SearchStarted(Event):
    """A search begins.

    Attributes:
        restart: number of the restart, 0 for the first search.
        sub_seed: seed of its single-arm searches.
    """

    restart: int
    sub_seed: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class NodeCreated(Event):
    """A node of the conflict tree is planned.

    Attributes:
        node: number of the node.
        parent: number of its parent, None for a root.
        arm: arm that the branch constrains or the fast track moves, None for a root and for several arms.
        constraint: description of what the branch forbids, None for a root.
        paths: arm -> configurations [k, dof] [rad] on a grid of `dt_s`.
        cost_rad: sum of the L1 lengths of the paths [rad].
        lower_bound_rad: lower bound of the cost [rad].
        conflicts: number of conflicts.
        conflicting_pairs: number of pairs of arms in conflict.
        fast_track: whether the fast track made the node.
        dt_s: step of the grid [s].
    """

    node: int
    parent: int | None
    arm: str | None
    constraint: str | None
    paths: Mapping[str, Float[np.ndarray, "k dof"]]
    cost_rad: float
    lower_bound_rad: float
    conflicts: int
    conflicting_pairs: int
    fast_track: bool = False
    dt_s: float = 0.1


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class NodeExpanded(Event):
    """A node leaves the open list to be branched.

    Attributes:
        node: number of the node.
        open_nodes: number of nodes that stay in the open list.
        expanded_nodes: number of nodes expanded so far.
        conflicts: number of conflicts of the node.
    """

    node: int
    open_nodes: int
    expanded_nodes: int
    conflicts: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ConflictChosen(Event):
    """A node is branched on a conflict interval.

    Attributes:
        node: number of the node.
        arm_a: first arm.
        arm_b: second arm.
        start_s: start of the interval [s].
        end_s: end of the interval [s].
    """

    node: int
    arm_a: str
    arm_b: str
    start_s: float
    end_s: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Replanned(Event):
    """The low level has planned one arm.

    Attributes:
        arm: the arm.
        constraints: number of its constraints.
        found: whether there is a path.
        iterations: number of iterations.
        tries: number of calls for this path so far.
    """

    arm: str
    constraints: int
    found: bool
    iterations: int
    tries: int


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceField:
    """Repulsive force k_rep (1/d - 1/d0) / d^2 between spheres nearer than `d0` [m].

    Attributes:
        k_rep: gain of the potential.
        d0: largest distance with a force [m].
        centres: whether d is the distance of the centres, not of the surfaces.
    """

    k_rep: float
    d0: float
    centres: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Repelled(Event):
    """Repulsion has modified a path. The event of its node follows.

    Attributes:
        arm: the arm of the path.
        before: configurations [k, dof] [rad] before.
        after: configurations [k, dof] [rad] after.
        iterations: number of accepted iterations.
        iterates: configurations after each iteration, if the watcher `wants_iterates`.
        field: the force field, None for a modification of another kind.
    """

    arm: str
    before: Float[np.ndarray, "k dof"]
    after: Float[np.ndarray, "k dof"]
    iterations: int
    iterates: tuple[Float[np.ndarray, "k dof"], ...] = ()
    field: ForceField | None = None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FastTracked(Event):
    """The fast track was tried on a node.

    Attributes:
        node: number of the node.
        arms: the arms whose paths were modified.
        solved: whether repulsion of these arms resolved all conflicts.
    """

    node: int
    arms: tuple[str, ...]
    solved: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SolutionFound(Event):
    """The plan of a node is certified.

    Attributes:
        node: number of the node.
        cost_rad: cost of the plan [rad].
        clearance_m: clearance between arms that is proved at every instant [m].
    """

    node: int
    cost_rad: float
    clearance_m: float


def _short(value: Any) -> str:
    """Returns a field as text: the shape of an array, the number of several paths."""
    if isinstance(value, np.ndarray):
        return "x".join(map(str, value.shape))
    return counted(len(value), "path") if isinstance(value, Mapping | tuple) else repr(value)


Watcher = Callable[[Event], None]
"""Function that gets every event of a run. It may raise `mmp_planners.StopPlanning`."""


def wants_iterates(watch: Watcher) -> bool:
    """Returns whether a watcher asks for the iterates of repulsion, by a true attribute of this name."""
    return bool(getattr(watch, "wants_iterates", False))


def ignore(event: Event) -> None:
    """Does nothing: the default watcher."""
