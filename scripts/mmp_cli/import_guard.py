"""Ctrl-C while modules are imported waits until they are.

In the middle of an import it is not safe to raise: a module may turn the `KeyboardInterrupt` into an `ImportError` or a
`RuntimeError`, and what is raised in a callback of the import system is printed and forgotten.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_AGAIN_S = 0.02
_IMPORT_SYSTEM = "<frozen importlib._bootstrap"


class ImportGuard:
    """The handler of Ctrl-C. In imports the first one waits for their end, and the second ends the process."""

    def __init__(self, exit_code: int) -> None:
        self._exit_code = exit_code
        self._waits = False
        self._hook = sys.unraisablehook

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """Handles SIGINT."""
        if not _is_importing(frame):
            raise KeyboardInterrupt
        if self._waits:
            os.write(2, b"mmp: interrupted\n")
            os._exit(self._exit_code)
        self._wait()

    def tell(self, unraisable: Any) -> None:
        """Takes the place of `sys.unraisablehook`: an interrupt that nothing can raise any more is raised again."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._wait()
        else:
            self._hook(unraisable)

    def _wait(self) -> None:
        self._waits = True
        signal.signal(signal.SIGALRM, self._retry)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)

    def _retry(self, signum: int, frame: FrameType | None) -> None:
        if _is_importing(frame):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
            return
        self._waits = False
        handler = signal.getsignal(signal.SIGINT)  # planning has one of its own
        if callable(handler):
            handler(signal.SIGINT, frame)


@contextmanager
def guarded_imports(exit_code: int) -> Iterator[None]:
    """Within it Ctrl-C raises `KeyboardInterrupt`, but not in the middle of an import. A second one there exits."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    guard = ImportGuard(exit_code)
    before, hook = signal.signal(signal.SIGINT, guard.handle), sys.unraisablehook
    sys.unraisablehook = guard.tell
    try:
        yield
    finally:
        sys.unraisablehook = hook
        if signal.getsignal(signal.SIGINT) == guard.handle:  # otherwise the process has been made deaf
            signal.signal(signal.SIGINT, before)


def ignore_interrupts() -> None:
    """Makes the process deaf to Ctrl-C: it is about to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT_SYSTEM):
            return True
        frame = frame.f_back
    return False
