"""Ctrl-C while planning: the first ends the planning with the best plan so far, the second ends the program."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from mmp_planners import Event, StopPlanning


class Interruption:
    """Whether Ctrl-C was pressed; `check` among the watchers makes sure that the planner has heard of it."""

    def __init__(self) -> None:
        self.happened = False

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """The signal handler. The core polls for signals, so this is raised in the middle of native code as well."""
        if self.happened:
            raise KeyboardInterrupt
        self.happened = True
        raise StopPlanning("interrupted")

    def check(self, event: Event) -> None:
        """A watcher that asks whether Ctrl-C was pressed: an exception from a handler can get lost, say in a callback
        of the garbage collector.
        """
        if self.happened:
            raise StopPlanning("interrupted")


@contextmanager
def stopping_on_interrupt() -> Iterator[Interruption]:
    """Within it Ctrl-C raises `StopPlanning`, once."""
    interruption = Interruption()
    before = signal.signal(signal.SIGINT, interruption.handle)
    try:
        yield interruption
    finally:
        signal.signal(signal.SIGINT, before)
