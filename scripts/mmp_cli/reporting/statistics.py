"""Statistics of the report: spreads over solved instances, and success rates with their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

_Z95 = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Statistics of `n` values, at least one. `std` is that of the sample (n - 1), None for a single value.

    `median` and `p90` are quantiles, interpolated between the two nearest values; `most` is the largest value.
    """

    n: int
    mean: float
    std: float | None
    median: float
    p90: float
    most: float


def spread(values: Iterable[float | None]) -> Spread | None:
    """Returns the spread of the values that are not None, or None if there are none."""
    known = np.array([value for value in values if value is not None], dtype=np.float64)
    if not known.size:
        return None
    median, p90 = np.quantile(known, [0.5, 0.9])
    return Spread(
        n=known.size,
        mean=float(known.mean()),
        std=float(known.std(ddof=1)) if known.size > 1 else None,
        median=float(median),
        p90=float(p90),
        most=float(known.max()),
    )


def wilson(solved: int, tried: int) -> tuple[float, float]:
    """Returns the 95 % interval of a success rate by Wilson (1927), within [0, 1]. Needs `tried` > 0."""
    rate, z2 = solved / tried, _Z95**2
    middle = rate + z2 / (2 * tried)
    half = _Z95 * math.sqrt(rate * (1 - rate) / tried + z2 / (4 * tried**2))
    scale = 1 + z2 / tried
    return max(0.0, (middle - half) / scale), min(1.0, (middle + half) / scale)
