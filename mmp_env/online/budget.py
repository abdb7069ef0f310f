"""The time of one call."""

from __future__ import annotations

import gc
import time

_RESERVE_SHARE, _LEAST_RESERVE_S, _MOST_RESERVE_S = 0.15, 0.0015, 0.008
"""Share of a call that is left for its last step, which cannot look at the clock, and its bounds [s]."""


class Budget:
    """The time that is left of a call.

    Args:
        seconds: what the call may take [s].
    """

    def __init__(self, seconds: float) -> None:
        reserve = min(max(_RESERVE_SHARE * seconds, _LEAST_RESERVE_S), _MOST_RESERVE_S)
        self._end = time.perf_counter() + seconds - reserve

    @property
    def left_s(self) -> float:
        """Time that is left [s], 0 or more."""
        return max(self._end - time.perf_counter(), 0.0)


class NoCollection:
    """Keeps Python's garbage collector from running in a `with` block: a full collection takes tens of milliseconds.

    The collector may run at the first allocation after the block, so a block should hold all of a call.
    """

    def __enter__(self) -> None:
        self._enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self._enabled:
            gc.enable()
