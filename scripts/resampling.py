"""How certain a ratio of two planners is, from resampled instances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

RESAMPLED = 10_000
"""Number of times that the instances are drawn again, with replacement."""


def interval(
    theirs: Sequence[float] | Float[np.ndarray, "n"],
    ours: Sequence[float] | Float[np.ndarray, "n"],
    *,
    least: float = 0.0,
    median: bool = False,
) -> tuple[float, float]:
    """Returns the 90 % interval of the ratio of sums (or medians), theirs to ours, over resampled instances.

    Args:
        theirs: a value of the other planner for each instance.
        ours: the value of our planner for the same instances.
        least: least divisor; for counts, whose sum may be 0.
        median: compare medians instead of sums.
    """
    chosen = np.random.default_rng(0).integers(0, len(ours), (RESAMPLED, len(ours)))
    over = np.median if median else np.sum
    one, other = (over(np.asarray(values, dtype=float)[chosen], axis=1) for values in (theirs, ours))
    low, high = np.quantile(one / np.maximum(other, least or 1e-300), (0.05, 0.95))
    return float(low), float(high)
