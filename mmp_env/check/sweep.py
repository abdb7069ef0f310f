"""Proof over time: steps are bisected until the clearance of every pair is proved or found too small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from mmp_env.check.items import Family, Items, Touch
from mmp_env.check.model import CellModel, Poses

RESOLUTION_M = 1e-7
"""A step is not bisected when its bound is this close to a clearance met in it: it is proved as it stands, or not."""
ROUNDING_M = 1e-9
"""What floating point may add up to in a bound, with room to spare."""
_STEP_RAD = 0.1  # longer steps are cut before the start, where it is cheap
_BLOCK = 300_000  # pairs times steps at once: bounds the memory of a check
_SEED_ITEMS = 128
_SLACK_M, _SLACK_SHARE = 1e-4, 0.02  # how far the proved clearance may stay behind the one found


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Clearance below what is required, at an instant (`proved`), or not excluded around it."""

    touch: Touch
    time: float
    clearance: float
    found: bool


@dataclass(kw_only=True)
class Sweep:
    """The running result: `least` [m] is the least clearance met at an instant, `proved` [m] the least proved."""

    required: float
    least: float = np.inf
    touch: Touch | None = None
    time: float = 0.0
    proved: float = np.inf
    instants: int = 0
    contacts: list[Contact] = field(default_factory=list)

    @property
    def target(self) -> float:
        """What to prove: the clearance required, or more where more was found, so that the report says how much."""
        return max(self.enough, (1 - _SLACK_SHARE) * self.least - _SLACK_M)

    @property
    def enough(self) -> float:
        """The least bound that proves the clearance required."""
        return self.required + ROUNDING_M


def prove_apart(
    model: CellModel,
    families: Sequence[Family],
    times: Float[np.ndarray, "t"],
    q: Float[np.ndarray, "t n"],
    required: float,
) -> Sweep:
    """Proves that every pair keeps `required` [m] apart while the joints go linearly through `q` [t, n] at `times`."""
    times, q = _cut(times, q)
    state = Sweep(required=required)
    size = max(_BLOCK // max(sum(map(len, families)), 1), 1)
    for first in range(0, len(times) - 1, size):
        block = slice(first, first + size + 1)
        poses = model.poses(times[block], q[block])
        state.instants += len(poses.times) - (first > 0)
        _prove(model, families, poses, state)
    return state


def _cut(times: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same motion in steps in which no joint turns far; a lone configuration becomes a step without motion."""
    if len(times) == 1:
        return np.repeat(times, 2), np.repeat(q, 2, axis=0)
    pieces = np.maximum(np.ceil(np.abs(np.diff(q, axis=0)).max(axis=1) / _STEP_RAD), 1).astype(int)
    step = np.repeat(np.arange(len(pieces)), pieces)
    share = (np.arange(len(step)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[step]
    at = np.append(step + share, len(pieces))
    low = np.minimum(at.astype(int), len(times) - 2)
    share = at - low
    return (
        times[low] * (1 - share) + times[low + 1] * share,
        q[low] * (1 - share)[:, None] + q[low + 1] * share[:, None],
    )


def _prove(model: CellModel, families: Sequence[Family], poses: Poses, state: Sweep) -> None:
    coarse = [family.coarse(poses) for family in families]
    # The closest few first: what they show decides how much of the rest has to be looked at.
    for family, lower in zip(families, coarse, strict=True):
        flat = lower.ravel()
        nearest = np.argpartition(flat, _SEED_ITEMS)[:_SEED_ITEMS] if flat.size > _SEED_ITEMS else np.arange(flat.size)
        nearest = nearest[~(flat[nearest] >= state.target)]
        _narrow(family, poses, _items(lower.shape, nearest), state, settle=False)
    todo = []
    for lower in coarse:
        done = lower.ravel() >= state.target
        state.proved = min(state.proved, lower.ravel()[done].min(initial=np.inf))
        todo.append(_items(lower.shape, np.flatnonzero(~done)))
    while any(map(len, todo)):
        todo = [_narrow(family, poses, items, state) for family, items in zip(families, todo, strict=True)]
        poses, todo = _bisect(model, poses, todo, state)


def _items(shape: tuple[int, ...], flat: np.ndarray) -> Items:
    step, pair = np.unravel_index(flat, shape)
    return Items(start=step, end=step + 1, pair=pair)


def _narrow(family: Family, poses: Poses, items: Items, state: Sweep, *, settle: bool = True) -> Items:
    """Measures the items, and returns those that are neither proved nor violated."""
    if not len(items):
        return items
    bounds = family.narrow(poses, items)
    k = int(np.argmin(bounds.found))
    if bounds.found[k] < state.least:
        state.least, state.time = float(bounds.found[k]), float(poses.times[bounds.at[k]])
        state.touch = family.names(int(items.pair[k]))
    if not settle:
        return items
    # Comparisons are such that a NaN proves nothing.
    bad = ~(bounds.found >= state.required)
    final = ~(bounds.found - bounds.lower > RESOLUTION_M)
    unproved = final & ~bad & ~(bounds.lower >= state.enough)
    done = (bounds.lower >= state.target) | final | bad
    state.proved = min(state.proved, bounds.lower[done & ~bad & ~unproved].min(initial=np.inf))
    for k in np.flatnonzero(bad | unproved):
        state.contacts.append(
            Contact(
                touch=family.names(int(items.pair[k])),
                time=float(poses.times[bounds.at[k]]),
                clearance=float(bounds.found[k] if bad[k] else bounds.lower[k]),
                found=bool(bad[k]),
            )
        )
    return items[~done]


def _bisect(model: CellModel, poses: Poses, todo: list[Items], state: Sweep) -> tuple[Poses, list[Items]]:
    """Every item becomes its two halves; the cell is placed once at each new instant."""
    steps = np.concatenate([np.stack([items.start, items.end], axis=1) for items in todo])
    if not len(steps):
        return poses, todo
    steps, place = np.unique(steps, axis=0, return_inverse=True)
    middle = model.poses(poses.times[steps].mean(axis=1), poses.q[steps].mean(axis=1))
    place = place.reshape(-1) + len(poses.times)
    state.instants += len(steps)
    halves = []
    for items in todo:
        mid, place = place[: len(items)], place[len(items) :]
        halves.append(
            Items(
                start=np.concatenate([items.start, mid]),
                end=np.concatenate([mid, items.end]),
                pair=np.tile(items.pair, 2),
            )
        )
    return poses + middle, halves
