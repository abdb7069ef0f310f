"""Ctrl-C, SIGTERM and SIGHUP end a command by an exception; while modules are imported they wait until they are.

In the middle of an import it is not safe to raise: a module may turn the `KeyboardInterrupt` into an `ImportError` or a
`RuntimeError`, and what is raised in a callback of the import system is printed and forgotten.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

_AGAIN_S = 0.02
_IMPORT_SYSTEM = "<frozen importlib._bootstrap"


class Ended(KeyboardInterrupt):
    """SIGTERM or SIGHUP has come: all that is open is left as at Ctrl-C, but by no planner's leave."""

    def __init__(self, signum: int) -> None:
        super().__init__(signum)
        self.signum = signum


def signal_of(interrupt: BaseException | None) -> signal.Signals:
    """Which signal a `KeyboardInterrupt` stands for."""
    return signal.Signals(interrupt.signum if isinstance(interrupt, Ended) else signal.SIGINT)


def describe_interrupt(interrupt: KeyboardInterrupt) -> str:
    """Returns in words which signal has ended the command, followed by the notes of the exception."""
    signum = signal_of(interrupt)
    words = "interrupted" if signum == signal.SIGINT else f"ended by {signum.name}"
    return "; ".join([words, *filter(None, getattr(interrupt, "__notes__", ()))])


class ImportGuard:
    """The handler of the signals. In imports the first one waits for their end, and the second ends the process."""

    def __init__(self) -> None:
        self._waiting: int | None = None
        self._hook = sys.unraisablehook

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """Handles SIGINT, SIGTERM and SIGHUP."""
        interrupt = KeyboardInterrupt() if signum == signal.SIGINT else Ended(signum)
        if not _is_importing(frame):
            raise interrupt
        if self._waiting is not None:
            with suppress(OSError):
                os.write(2, f"mmp: {describe_interrupt(interrupt)}\n".encode())
            end_at_once(128 + signum)
        self._wait(signum)

    def tell(self, unraisable: Any) -> None:
        """Takes the place of `sys.unraisablehook`: an interrupt that nothing can raise any more is raised again."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._wait(signal_of(unraisable.exc_value))
        else:
            self._hook(unraisable)

    def _wait(self, signum: int) -> None:
        self._waiting = signum
        signal.signal(signal.SIGALRM, self._retry)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)

    def _retry(self, signum: int, frame: FrameType | None) -> None:
        if _is_importing(frame):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
            return
        signum, self._waiting = self._waiting or signal.SIGINT, None
        handler = signal.getsignal(signum)  # planning has one of its own
        if callable(handler):
            handler(signum, frame)


@contextmanager
def guarded_imports() -> Iterator[None]:
    """Within it Ctrl-C raises `KeyboardInterrupt`, and SIGTERM and SIGHUP `Ended`, but not in the middle of an import.

    A second one there exits. What the caller has made the process deaf to, as `nohup` does, stays so.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    guard, hook = ImportGuard(), sys.unraisablehook
    heard = [signal.SIGINT, *(s for s in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(s) == signal.SIG_DFL)]
    before = {signum: signal.signal(signum, guard.handle) for signum in heard}
    sys.unraisablehook = guard.tell
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for signum, handler in before.items():
            if signal.getsignal(signum) == guard.handle:  # otherwise the process has been made deaf
                signal.signal(signum, handler)


def end_at_once(code: int) -> NoReturn:
    """Ends the process without taking the interpreter down; no temporary file stays."""
    ignore_interrupts()
    if (temporaries := sys.modules.get("mmp_env.files.temporaries")) is not None:
        temporaries.remove_all()
    os._exit(code)


def ignore_interrupts() -> None:
    """Makes the process deaf to Ctrl-C, SIGTERM and SIGHUP: it is about to end."""
    if threading.current_thread() is threading.main_thread():
        for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(signum, signal.SIG_IGN)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT_SYSTEM):
            return True
        frame = frame.f_back
    return False
