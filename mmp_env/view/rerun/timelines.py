"""The timelines of a recording, and rows of data on them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.view.rerun.sdk import require

LONGEST_S = 1e9
"""Longest plan in a recording [s]: its timelines count nanoseconds in 64 bits."""
EXPANSION = "expansion"
"""Number of nodes expanded so far; 0 is the root before anything happened, the last one is what came of it."""
REPULSION = "repulsion"
"""Iterations of ModifyMotion, one after the other over all paths that are shown."""
PLAN_TIME = "plan time"
"""Seconds since the plan began."""
STEP = "step"
"""Steps of an environment since its recording began; a reset counts as one."""


def check_duration(duration_s: float) -> None:
    """Raises `MmpError` for a plan that is longer than a timeline."""
    if not duration_s <= LONGEST_S:
        raise MmpError(f"the plan takes {duration_s:.6g} s; a recording holds {LONGEST_S:g} s at most")


def sequence(timeline: str, numbers: Iterable[int]) -> Any:
    """An index column of whole numbers."""
    return require().TimeColumn(timeline, sequence=list(numbers))


def seconds(times: Float[np.ndarray, "t"] | Sequence[float]) -> Any:
    """An index column on `plan time` [s]."""
    return require().TimeColumn(PLAN_TIME, duration=np.asarray(times, dtype=float).tolist())
