"""Items of measurement: pairs of things in steps of a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env.check.model import Poses


@dataclass(frozen=True, kw_only=True)
class Touch:
    """Names of a pair: the rule that keeps it apart, its arms, and the two `things`, such as `arm0/forearm`."""

    rule: str
    arms: tuple[str, ...]
    things: tuple[str, str]


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionSteps:
    """Motion windows from poses `start` to poses `end` [u], by index.

    Every joint moves by `move` [u, n] [rad or m] and stays within `bend` [u, n] [rad or m] of a straight line.
    """

    start: Int[np.ndarray, "u"]
    end: Int[np.ndarray, "u"]
    move: Float[np.ndarray, "u n"]
    bend: Float[np.ndarray, "u n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Items:
    """Pairs in steps: `step` [i] is an index into `steps`, `pair` [i] into the pairs of a family."""

    steps: MotionSteps
    step: Int[np.ndarray, "i"]
    pair: Int[np.ndarray, "i"]

    def __len__(self) -> int:
        return len(self.pair)

    def __getitem__(self, chosen: Bool[np.ndarray, "i"] | Int[np.ndarray, "j"]) -> Items:
        return Items(steps=self.steps, step=self.step[chosen], pair=self.pair[chosen])

    @property
    def start(self) -> Int[np.ndarray, "i"]:
        """The poses at which the steps start."""
        return self.steps.start[self.step]

    @property
    def end(self) -> Int[np.ndarray, "i"]:
        """The poses at which the steps end."""
        return self.steps.end[self.step]


@dataclass(frozen=True, kw_only=True, eq=False)
class Bounds:
    """Clearances [m] of items: `lower` [i] during the whole step, `found` [i] at the pose `at` [i], one of its ends."""

    lower: Float[np.ndarray, "i"]
    found: Float[np.ndarray, "i"]
    at: Int[np.ndarray, "i"]

    @classmethod
    def of(
        cls,
        items: Items,
        lower: Float[np.ndarray, "i"],
        at_start: Float[np.ndarray, "i"],
        at_end: Float[np.ndarray, "i"],
    ) -> Bounds:
        """Returns the bounds of a lower bound and the clearances at both ends of the steps [m]."""
        return cls(
            lower=lower,
            found=np.minimum(at_start, at_end),
            at=np.where(at_start <= at_end, items.start, items.end),
        )


@runtime_checkable
class Family(Protocol):
    """Pairs that one rule keeps apart, such as clouds and obstacles, and their measurement."""

    @property
    def rule(self) -> str:
        """The rule: `arm-arm`, `arm-obstacle` or `self`."""
        ...

    def __len__(self) -> int:
        """Returns the number of pairs."""
        ...

    def coarse(self, poses: Poses, steps: MotionSteps, cutoff: float) -> tuple[Items, Float[np.ndarray, "i"]]:
        """Returns the items that may be closer than `cutoff` [m] in the steps between consecutive poses.

        Returns:
            The items, step after step, and lower bounds on their clearances [m]. All others are at least `cutoff`.
        """
        ...

    def narrow(self, poses: Poses, items: Items, target: float) -> Bounds:
        """Returns good bounds for a few pairs and steps. A bound of `target` [m] is good enough."""
        ...

    def names(self, pair: int) -> Touch:
        """Returns the names of a pair."""
        ...


def by_value(values: Int[np.ndarray, "i"]) -> Iterator[tuple[int, Int[np.ndarray, "k"]]]:
    """Yields each value among the values of items, such as their pairs, with its items."""
    order = np.argsort(values, kind="stable")
    found, first = np.unique(values[order], return_index=True)
    for value, chosen in zip(found, np.split(order, first[1:]), strict=True):
        yield int(value), chosen
