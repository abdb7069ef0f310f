"""Ctrl-C while planning: the first ends the planning with the best plan so far, the second ends the program."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from mmp_planners import Event, StopPlanning, Watcher


class Interruption:
    """Whether Ctrl-C was pressed; a watcher that asks `check` makes sure that the planner has heard of it."""

    def __init__(self) -> None:
        self.happened = False

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """The signal handler. The core polls for signals, so this is raised in the middle of native code as well."""
        if self.happened:
            raise KeyboardInterrupt
        self.happened = True
        raise StopPlanning("interrupted")

    def checked(self, watch: Watcher) -> Watcher:
        """`watch`, asked after a look whether Ctrl-C was pressed: an exception from a handler can get lost, say in a
        callback of the garbage collector.
        """

        def checked(event: Event) -> None:
            if self.happened:
                raise StopPlanning("interrupted")
            watch(event)

        return checked


@contextmanager
def stopping_on_interrupt() -> Iterator[Interruption]:
    """Within it Ctrl-C raises `StopPlanning`, once."""
    interruption = Interruption()
    before = signal.signal(signal.SIGINT, interruption.handle)
    try:
        yield interruption
    finally:
        signal.signal(signal.SIGINT, before)
