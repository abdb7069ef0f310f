"""Ctrl-C during a run: the first ends what is running and keeps what there is, the second ends the program."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from mmp_cli.import_guard import EndedBySignal
from mmp_planners import Event, StopPlanning

T = TypeVar("T")


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
    with _handled_by(interruption.handle):
        yield interruption


class Interrupts:
    """State of Ctrl-C during the steps of a run. The first one ends a step, or is noted while a file is written.

    Before the first step it raises `KeyboardInterrupt`, and between the steps it is noted.
    """

    def __init__(self) -> None:
        self.happened = False
        self._raises = True
        self._before = signal.getsignal(signal.SIGINT)

    def run(self, step: Callable[[], T], *, whole: bool = False) -> T | None:
        """Returns what a step returns, or None if the first Ctrl-C has ended it. A `whole` step is not ended.

        Raises:
            KeyboardInterrupt: for the second Ctrl-C, and for SIGTERM and SIGHUP.
        """
        try:
            self._raises = not whole
            out = step()
            self._raises = False
        except KeyboardInterrupt as interrupt:
            self._raises = False
            if self.happened or isinstance(interrupt, EndedBySignal):
                raise
            self.happened = True
            return None
        return out

    def only_note(self) -> None:
        """Ends a step outside `run`: from now on the first Ctrl-C is noted."""
        self._raises = False

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """Handles SIGINT."""
        if not (self.happened or self._raises):
            self.happened = True
        elif callable(self._before):
            self._before(signum, frame)  # during an import it calls this handler again when the import is done
        else:
            raise KeyboardInterrupt


@contextmanager
def interruptible_steps() -> Iterator[Interrupts]:
    """Installs the handler of `Interrupts`."""
    interrupts = Interrupts()
    with _handled_by(interrupts.handle):
        yield interrupts


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
