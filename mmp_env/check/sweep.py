"""The proof over time: bisects steps until the clearance of every pair is proved, or found too small."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mmp_env.check.items import Bounds, Family, Items, Touch
from mmp_env.check.model import CellModel
from mmp_env.check.trajectory import PlacedTrajectory, Trajectory

RESOLUTION_M = 1e-7
"""Resolution [m]. A step whose bound is this close to a clearance met in it is not bisected further."""
ROUNDING_M = 1e-9
"""Upper bound of the rounding errors in a bound [m]."""
MOST_MEASURED, MOST_PER_ITEM = 10_000, 10
"""Measurements after which a check gives up: this many, and this many for each pair that the broad phase leaves."""
_BLOCK = 400_000
"""Pairs times steps in one block; bounds the memory of a check."""
_FEWEST_STEPS = 32
"""Steps in one block, at least."""
_SEED_ITEMS = 128
"""Nearest pairs that each block measures first."""
_CUTOFFS_M = (0.1, 0.4, 1.6, np.inf)
"""Clearances [m] within which the first block looks for the nearest pairs, one after another."""
_SLACK_M, _SLACK_SHARE = 1e-4, 0.02
"""Largest distance of the proved clearance from the one found: [m], and relative."""


@dataclass(frozen=True, kw_only=True)
class Shortfall:
    """A clearance [m] below the `required` one, found at an instant (`found`) or not excluded around it."""

    touch: Touch
    time: float
    clearance: float
    required: float
    found: bool


@dataclass(kw_only=True)
class Clearance:
    """The running result of one rule [m]: the `required` clearance, the `least` one found, the least `proved` one.

    The least one was found at `time` [s], between the things of `touch`.
    """

    required: float
    least: float = np.inf
    touch: Touch | None = None
    time: float = 0.0
    proved: float = np.inf

    @property
    def enough(self) -> float:
        """The least bound [m] that proves the required clearance."""
        return self.required + ROUNDING_M


@dataclass(kw_only=True)
class Sweep:
    """The running result: the clearance of each rule, and the shortfalls.

    `measured` counts measurements of a pair in a step. At most `allowed` are made, which grows with motion and cell.
    """

    clearances: Mapping[str, Clearance]
    instants: int = 0
    measured: int = 0
    allowed: int = MOST_MEASURED
    shortfalls: list[Shortfall] = field(default_factory=list)

    def target(self, rule: str) -> float:
        """Returns the clearance to prove [m]: the required one, or nearly the least found, for the report."""
        here = self.clearances[rule]
        return max(here.enough, (1 - _SLACK_SHARE) * here.least - _SLACK_M)

    def cutoff(self, rule: str) -> float:
        """Returns the clearance [m] from which on nothing has to be measured."""
        return max(self.target(rule), self.clearances[rule].least)

    @property
    def proved(self) -> float:
        """The least clearance [m] proved of any rule."""
        return min(clearance.proved for clearance in self.clearances.values())

    @property
    def nearest(self) -> Clearance:
        """The clearance of the rule with the least one found."""
        return min(self.clearances.values(), key=lambda clearance: clearance.least)


def prove_apart(
    model: CellModel, families: Sequence[Family], trajectory: Trajectory, required: Mapping[str, float]
) -> Sweep:
    """Proves that every pair keeps the clearance that its rule requires along a trajectory.

    Args:
        required: rule -> clearance [m].
    """
    state = Sweep(clearances={rule: Clearance(required=metres) for rule, metres in required.items()})
    places = trajectory.grid()
    size = max(_BLOCK // max(sum(map(len, families)), 1), _FEWEST_STEPS)
    for first in range(0, len(places) - 1, size):
        track = PlacedTrajectory(model, trajectory, places[first : first + size + 1])
        _prove(families, track, state)
        state.instants += len(track.poses.times) - (first > 0)  # blocks meet in a pose
    return state


def _prove(families: Sequence[Family], track: PlacedTrajectory, state: Sweep) -> None:
    coarse = [_seeded(family, track, state) for family in families]
    todo = []
    for family, (items, lower, cutoff) in zip(families, coarse, strict=True):
        clearance = state.clearances[family.rule]
        done = lower >= state.target(family.rule)
        clearance.proved = min(clearance.proved, cutoff, lower[done].min(initial=np.inf))
        todo.append(items[~done])
    state.allowed += MOST_PER_ITEM * sum(map(len, todo))
    while count := sum(map(len, todo)):
        state.measured += count
        last = state.measured + 2 * count > state.allowed
        todo = [_narrow(family, track, items, state, last=last) for family, items in zip(families, todo, strict=True)]
        todo = _halve(track, todo)


def _seeded(family: Family, track: PlacedTrajectory, state: Sweep) -> tuple[Items, np.ndarray, float]:
    """Measures the closest few items: their clearance decides how many of the others must be measured.

    Returns:
        The items that may be closer than a cutoff, their lower bounds [m], and the cutoff [m], which all others keep.
        It is at least the least clearance found, so that the proved one does not depend on it.
    """
    known = state.cutoff(family.rule)
    guesses = iter([known] if np.isfinite(known) else _CUTOFFS_M)
    cutoff = next(guesses)
    items, lower = family.coarse(track.poses, track.steps, cutoff)
    while len(items) < _SEED_ITEMS and (wider := next(guesses, None)) is not None:
        cutoff = wider
        items, lower = family.coarse(track.poses, track.steps, cutoff)
    nearest = np.argpartition(lower, _SEED_ITEMS)[:_SEED_ITEMS] if len(lower) > _SEED_ITEMS else np.arange(len(lower))
    nearest = nearest[~(lower[nearest] >= state.target(family.rule))]
    if len(nearest):
        _measure(family, track, items[nearest], state)
    if (needed := state.cutoff(family.rule)) > cutoff:
        return *family.coarse(track.poses, track.steps, needed), needed
    return items, lower, cutoff


def _halve(track: PlacedTrajectory, todo: list[Items]) -> list[Items]:
    """Returns two halves for every item; places the cell once for all items of a step."""
    steps, place = np.unique(np.concatenate([items.step for items in todo]), return_inverse=True)
    track.halve(steps)
    places = np.split(place, np.cumsum([len(items) for items in todo])[:-1])
    return [
        Items(steps=track.steps, step=np.concatenate([first, first + len(steps)]), pair=np.tile(items.pair, 2))
        for first, items in zip(places, todo, strict=True)
    ]


def _narrow(family: Family, track: PlacedTrajectory, items: Items, state: Sweep, *, last: bool) -> Items:
    """Measures the items. Returns those that are neither proved nor violated, none if this is the `last` time."""
    if not len(items):
        return items
    bounds, clearance = _measure(family, track, items, state), state.clearances[family.rule]
    # A NaN proves nothing in these comparisons. Bisection does not help where a bound is not finite.
    bad = ~(bounds.found >= clearance.required)
    final = ~(bounds.found - bounds.lower > RESOLUTION_M) | ~np.isfinite(bounds.lower) | last
    unproved = final & ~bad & ~(bounds.lower >= clearance.enough)
    done = (bounds.lower >= state.target(family.rule)) | final | bad
    clearance.proved = min(clearance.proved, bounds.lower[done & ~bad & ~unproved].min(initial=np.inf))
    for k in np.flatnonzero(bad | unproved):
        state.shortfalls.append(
            Shortfall(
                touch=family.names(int(items.pair[k])),
                time=float(track.poses.times[bounds.at[k]]),
                clearance=float(bounds.found[k] if bad[k] else bounds.lower[k]),
                required=clearance.required,
                found=bool(bad[k]),
            )
        )
    return items[~done]


def _measure(family: Family, track: PlacedTrajectory, items: Items, state: Sweep) -> Bounds:
    """Returns the bounds of one item or more, and keeps the least clearance found."""
    bounds, clearance = family.narrow(track.poses, items, state.target(family.rule)), state.clearances[family.rule]
    k = int(np.argmin(bounds.found))
    if bounds.found[k] < clearance.least:
        clearance.least, clearance.time = float(bounds.found[k]), float(track.poses.times[bounds.at[k]])
        clearance.touch = family.names(int(items.pair[k]))
    return bounds
