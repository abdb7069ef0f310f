"""What a planner tells its watcher. Planners are silent otherwise; watching changes no plan.

Arrays in events are the planner's own: look, do not write.
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
    """Base of all events. `elapsed_s` is since the start of planning."""

    elapsed_s: float

    @brief
    def __repr__(self) -> str:
        return ", ".join(f"{field.name}={_short(getattr(self, field.name))}" for field in fields(self))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SearchStarted(Event):
    """A conflict tree begins; the first one is `restart` 0. `sub_seed` seeds its single-arm searches."""

    restart: int
    sub_seed: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class NodeCreated(Event):
    """A node of the tree: its paths on the grid of `dt_s` [s], cost, bound and conflicts, and what sets it apart.

    `constraint` says in words what the branch forbids, `arm` whom; both None for a root. `fast_track` marks a node that
    repulsion of one arm made free of conflicts.
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
    """A node is taken from the open list."""

    node: int
    open_nodes: int
    expanded_nodes: int
    conflicts: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ConflictChosen(Event):
    """The conflict that a node is branched on: two arms and the interval [`start_s`, `end_s`]."""

    node: int
    arm_a: str
    arm_b: str
    start_s: float
    end_s: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Replanned(Event):
    """A call of the low level for one arm: whether it found a path, and how many iterations it took."""

    arm: str
    constraints: int
    found: bool
    iterations: int
    tries: int


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceField:
    """Spheres nearer than `d0` [m] push with k_rep (1/d - 1/d0) / d^2; d between surfaces, or `centres`."""

    k_rep: float
    d0: float
    centres: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Repelled(Event):
    """A repulsive modification: the path before and after and, where the watcher `wants_iterates`, each iterate.

    The node that it is for is told of next. `field` is what pushed; None where a modification has another kind.
    """

    arm: str
    before: Float[np.ndarray, "k dof"]
    after: Float[np.ndarray, "k dof"]
    iterations: int
    iterates: tuple[Float[np.ndarray, "k dof"], ...] = ()
    field: ForceField | None = None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FastTracked(Event):
    """The fast track was tried on a node; `arm` is in every conflict, `solved` says whether all of them went away."""

    node: int
    arm: str
    solved: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SolutionFound(Event):
    """A node without conflicts whose plan has its certificate: `clearance_m` is proved at every instant."""

    node: int
    cost_rad: float
    clearance_m: float


def _short(value: Any) -> str:
    """Returns a field as text: of arrays their shape, of several paths how many."""
    if isinstance(value, np.ndarray):
        return "x".join(map(str, value.shape))
    return counted(len(value), "path") if isinstance(value, Mapping | tuple) else repr(value)


Watcher = Callable[[Event], None]


def wants_iterates(watch: Watcher) -> bool:
    """Whether a watcher asks, by a true attribute of this name, for the iterates of repulsion."""
    return bool(getattr(watch, "wants_iterates", False))


def ignore(event: Event) -> None:
    """The watcher that looks away."""
