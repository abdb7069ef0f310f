"""Ctrl-C during planning: the first ends the planning with the best plan so far, the second ends the program."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from mmp_planners import Event, StopPlanning


class Interruption:
    """State of Ctrl-C. `check`, as a watcher, raises again if the exception of the handler got lost."""

    def __init__(self) -> None:
        self.happened = False

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """Handles SIGINT. The native core polls for signals, so this interrupts native code too."""
        if self.happened:
            raise KeyboardInterrupt
        self.happened = True
        raise StopPlanning("interrupted")

    def check(self, event: Event) -> None:
        """Raises `StopPlanning` if Ctrl-C was pressed: the handler's exception can get lost in a callback."""
        if self.happened:
            raise StopPlanning("interrupted")


@contextmanager
def stopping_on_interrupt() -> Iterator[Interruption]:
    """Installs a handler: the first Ctrl-C raises `StopPlanning`, the second `KeyboardInterrupt`."""
    interruption = Interruption()
    before = signal.signal(signal.SIGINT, interruption.handle)
    try:
        yield interruption
    finally:
        signal.signal(signal.SIGINT, before)
