"""Turns Ctrl-C, SIGTERM and SIGHUP into exceptions, but not in the middle of an import.

There an exception is not safe: a module may turn the `KeyboardInterrupt` into an `ImportError` or a `RuntimeError`, and
Python prints and forgets an exception in a callback of the import system. The signal waits until the import is done.
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


class EndedBySignal(KeyboardInterrupt):
    """SIGTERM or SIGHUP. It ends the command like Ctrl-C, but does not let a planner finish."""

    def __init__(self, signum: int) -> None:
        super().__init__(signum)
        self.signum = signum


def signal_of(interrupt: BaseException | None) -> signal.Signals:
    """Returns the signal that a `KeyboardInterrupt` stands for."""
    return signal.Signals(interrupt.signum if isinstance(interrupt, EndedBySignal) else signal.SIGINT)


def describe_interrupt(interrupt: KeyboardInterrupt) -> str:
    """Returns in words which signal has ended the command, followed by the notes of the exception."""
    signum = signal_of(interrupt)
    words = "interrupted" if signum == signal.SIGINT else f"ended by {signum.name}"
    return "; ".join([words, *filter(None, getattr(interrupt, "__notes__", ()))])


class ImportGuard:
    """The signal handler. During an import the first signal waits for its end, and the second ends the process."""

    def __init__(self) -> None:
        self._waiting: int | None = None
        self._hook = sys.unraisablehook

    def handle(self, signum: int, frame: FrameType | None) -> None:
        """Handles SIGINT, SIGTERM and SIGHUP."""
        interrupt = KeyboardInterrupt() if signum == signal.SIGINT else EndedBySignal(signum)
        if not _is_importing(frame):
            raise interrupt
        if self._waiting is not None:
            with suppress(OSError):
                os.write(2, f"mmp: {describe_interrupt(interrupt)}\n".encode())
            end_at_once(128 + signum)
        self._wait(signum)

    def handle_unraisable(self, unraisable: Any) -> None:
        """Replaces `sys.unraisablehook`: it raises an interrupt again that got lost in a callback."""
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
        handler = signal.getsignal(signum)  # planning installs its own handler
        if callable(handler):
            handler(signum, frame)


@contextmanager
def guarded_imports() -> Iterator[None]:
    """Installs the signal handler: Ctrl-C raises `KeyboardInterrupt`, SIGTERM and SIGHUP raise `EndedBySignal`.

    During an import the first signal waits, and the second ends the process. A signal that the caller ignores, as
    `nohup` does, stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    guard, hook = ImportGuard(), sys.unraisablehook
    signals = [signal.SIGINT, *(s for s in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(s) == signal.SIG_DFL)]
    before = {signum: signal.signal(signum, guard.handle) for signum in signals}
    sys.unraisablehook = guard.handle_unraisable
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for signum, handler in before.items():
            if signal.getsignal(signum) == guard.handle:  # otherwise the signal is ignored by now
                signal.signal(signum, handler)


def end_at_once(code: int) -> NoReturn:
    """Ends the process without shutting the interpreter down. It removes temporary files first."""
    ignore_interrupts()
    if (temporaries := sys.modules.get("mmp_env.files.temporaries")) is not None:
        temporaries.remove_all()
    os._exit(code)


def ignore_interrupts() -> None:
    """Ignores Ctrl-C, SIGTERM and SIGHUP from now on: the process is about to end."""
    if threading.current_thread() is threading.main_thread():
        for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(signum, signal.SIG_IGN)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT_SYSTEM):
            return True
        frame = frame.f_back
    return False
