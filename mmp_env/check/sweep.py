"""Proof over time: steps are bisected until the clearance of every pair is proved or found too small."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mmp_env.check.items import Bounds, Family, Items, Touch
from mmp_env.check.model import CellModel
from mmp_env.check.path import Path, Track

RESOLUTION_M = 1e-7
"""A step is not bisected when its bound is this close to a clearance met in it: it is proved as it stands, or not."""
ROUNDING_M = 1e-9
"""What floating point may add up to in a bound, with room to spare."""
MOST_MEASURED, MOST_PER_ITEM = 10_000, 10
"""A check measures this often, and so often for each pair in a step that the broad phase leaves; then it gives up."""
_BLOCK = 400_000  # pairs times steps at once: bounds the memory of a check
_SEED_ITEMS = 128
_SLACK_M, _SLACK_SHARE = 1e-4, 0.02  # how far the proved clearance may stay behind the one found


@dataclass(frozen=True, kw_only=True)
class Contact:
    """A clearance [m] below what is required, met at an instant (`found`) or not excluded around it."""

    touch: Touch
    time: float
    clearance: float
    required: float
    found: bool


@dataclass(kw_only=True)
class Clearance:
    """The running result of one rule [m]: `required`, the `least` met at an instant, the least `proved`.

    The least was met at `time` [s] between the things of `touch`.
    """

    required: float
    least: float = np.inf
    touch: Touch | None = None
    time: float = 0.0
    proved: float = np.inf

    @property
    def enough(self) -> float:
        """The least bound that proves the clearance required."""
        return self.required + ROUNDING_M


@dataclass(kw_only=True)
class Sweep:
    """The running result: rule -> clearance, and the contacts.

    `measured` counts pairs in steps; there are no more than `allowed`, which grows with the motion and with the cell.
    """

    clearances: Mapping[str, Clearance]
    instants: int = 0
    measured: int = 0
    allowed: int = MOST_MEASURED
    contacts: list[Contact] = field(default_factory=list)

    def target(self, rule: str) -> float:
        """What to prove [m]: the clearance required, or more where more was found, so that the report says how much."""
        here = self.clearances[rule]
        return max(here.enough, (1 - _SLACK_SHARE) * here.least - _SLACK_M)

    @property
    def proved(self) -> float:
        """The least clearance proved of any rule [m]."""
        return min(clearance.proved for clearance in self.clearances.values())

    @property
    def nearest(self) -> Clearance:
        """The rule with the least clearance met."""
        return min(self.clearances.values(), key=lambda clearance: clearance.least)


def prove_apart(model: CellModel, families: Sequence[Family], path: Path, required: Mapping[str, float]) -> Sweep:
    """Proves that every pair keeps what its rule requires [m] all along a path."""
    state = Sweep(clearances={rule: Clearance(required=metres) for rule, metres in required.items()})
    places = path.grid()
    size = max(_BLOCK // max(sum(map(len, families)), 1), 1)
    for first in range(0, len(places) - 1, size):
        track = Track(model, path, places[first : first + size + 1])
        _prove(families, track, state)
        state.instants += len(track.poses.times) - (first > 0)  # blocks meet in a pose
    return state


def _prove(families: Sequence[Family], track: Track, state: Sweep) -> None:
    coarse = [family.coarse(track.poses, track.steps) for family in families]
    # The closest few first: what they show decides how much of the rest has to be looked at.
    for family, lower in zip(families, coarse, strict=True):
        flat = lower.ravel()
        nearest = np.argpartition(flat, _SEED_ITEMS)[:_SEED_ITEMS] if flat.size > _SEED_ITEMS else np.arange(flat.size)
        nearest = nearest[~(flat[nearest] >= state.target(family.rule))]
        if len(nearest):
            _measure(family, track, _items(track, lower.shape, nearest), state)
    todo = []
    for family, lower in zip(families, coarse, strict=True):
        clearance = state.clearances[family.rule]
        done = lower.ravel() >= state.target(family.rule)
        clearance.proved = min(clearance.proved, lower.ravel()[done].min(initial=np.inf))
        todo.append(_items(track, lower.shape, np.flatnonzero(~done)))
    state.allowed += MOST_PER_ITEM * sum(map(len, todo))
    while count := sum(map(len, todo)):
        state.measured += count
        last = state.measured + 2 * count > state.allowed
        todo = [_narrow(family, track, items, state, last=last) for family, items in zip(families, todo, strict=True)]
        todo = _halve(track, todo)


def _halve(track: Track, todo: list[Items]) -> list[Items]:
    """Every item becomes its two halves; the cell is placed once for all items of a step."""
    steps, place = np.unique(np.concatenate([items.step for items in todo]), return_inverse=True)
    track.halve(steps)
    places = np.split(place, np.cumsum([len(items) for items in todo])[:-1])
    return [
        Items(steps=track.steps, step=np.concatenate([first, first + len(steps)]), pair=np.tile(items.pair, 2))
        for first, items in zip(places, todo, strict=True)
    ]


def _items(track: Track, shape: tuple[int, ...], flat: np.ndarray) -> Items:
    step, pair = np.unravel_index(flat, shape)
    return Items(steps=track.steps, step=step, pair=pair)


def _narrow(family: Family, track: Track, items: Items, state: Sweep, *, last: bool) -> Items:
    """Measures the items, and returns those that are neither proved nor violated: none if this is the `last` time."""
    if not len(items):
        return items
    bounds, clearance = _measure(family, track, items, state), state.clearances[family.rule]
    # Comparisons are such that a NaN proves nothing, and what is not finite will not become so by bisection.
    bad = ~(bounds.found >= clearance.required)
    final = ~(bounds.found - bounds.lower > RESOLUTION_M) | ~np.isfinite(bounds.lower) | last
    unproved = final & ~bad & ~(bounds.lower >= clearance.enough)
    done = (bounds.lower >= state.target(family.rule)) | final | bad
    clearance.proved = min(clearance.proved, bounds.lower[done & ~bad & ~unproved].min(initial=np.inf))
    for k in np.flatnonzero(bad | unproved):
        state.contacts.append(
            Contact(
                touch=family.names(int(items.pair[k])),
                time=float(track.poses.times[bounds.at[k]]),
                clearance=float(bounds.found[k] if bad[k] else bounds.lower[k]),
                required=clearance.required,
                found=bool(bad[k]),
            )
        )
    return items[~done]


def _measure(family: Family, track: Track, items: Items, state: Sweep) -> Bounds:
    """The bounds of items, one at least; remembers the least clearance found."""
    bounds, clearance = family.narrow(track.poses, items, state.target(family.rule)), state.clearances[family.rule]
    k = int(np.argmin(bounds.found))
    if bounds.found[k] < clearance.least:
        clearance.least, clearance.time = float(bounds.found[k]), float(track.poses.times[bounds.at[k]])
        clearance.touch = family.names(int(items.pair[k]))
    return bounds
