"""Pairs of boxes along the axes of the world that come close, by sort and sweep."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int


def near_boxes(
    low: Float[np.ndarray, "k 3"], high: Float[np.ndarray, "k 3"], gap: float
) -> tuple[Int[np.ndarray, "m"], Int[np.ndarray, "m"]]:
    """Returns the pairs of boxes, first < second, that may be closer than `gap` [m].

    Boxes that are not finite are near all others.
    """
    if not (np.isfinite(gap) and np.isfinite(low).all() and np.isfinite(high).all()):
        return np.triu_indices(len(low), 1)
    axis = int(np.argmax(np.ptp(low, axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    # Behind each box in this order come those that begin before it ends.
    last = np.searchsorted(low[order, axis], high[order, axis] + gap, side="right")
    count = np.maximum(last - np.arange(1, len(order) + 1), 0)
    behind = np.arange(1, len(order) + 1)
    one, other = order[np.repeat(behind - 1, count)], order[ranges(behind, behind + count)]
    near = box_gaps(low, high, one, other) < gap
    return np.minimum(one, other)[near], np.maximum(one, other)[near]


def box_gaps(
    low: Float[np.ndarray, "k 3"],
    high: Float[np.ndarray, "k 3"],
    first: Int[np.ndarray, "m"],
    second: Int[np.ndarray, "m"],
) -> Float[np.ndarray, "m"]:
    """Returns lower bounds [m] on the distances of pairs of boxes, negative for boxes that overlap."""
    return np.maximum(low[second] - high[first], low[first] - high[second]).max(axis=1, initial=-np.inf)


def ranges(begin: Int[np.ndarray, "k"], end: Int[np.ndarray, "k"]) -> Int[np.ndarray, "m"]:
    """Returns the whole numbers from each `begin` up to its `end`, which is not less, one range after another."""
    count = end - begin
    return np.arange(count.sum()) + np.repeat(begin - (np.cumsum(count) - count), count)
