"""The child's side of `planner_process`: it makes the planner, lets it plan, and tells events and result."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import threading
from collections.abc import Iterator, Mapping
from multiprocessing.connection import Connection
from typing import Any

from mmp_cli.benchmark.worker import end_with, flush_output
from mmp_cli.interrupt import Interruption, stopping_on_interrupt
from mmp_cli.planner_messages import is_known, result_to_data, written
from mmp_env.errors import MmpError, in_words
from mmp_env.model.problem import Problem
from mmp_planners import Planner, PlanResult, Status, StopPlanning, make
from mmp_planners.safe_plan import failed, run_planner

MADE, MISUSE, EVENT, RESULT = "made", "misuse", "event", "result"
"""Kinds of messages. A process tells `MADE` or `MISUSE`; then events, and `RESULT` or `MISUSE`."""


@contextlib.contextmanager
def held_back() -> Iterator[None]:
    """Within it SIGINT waits, so that no message is torn."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def serve(connection: Connection, of_parent: Connection, parent: int, name: str, options: Mapping[str, Any]) -> None:
    """Makes the planner and plans what comes. SIGINT is blocked on entry, and is let through while it plans."""
    of_parent.close()
    for signum in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, signal.SIG_DFL)  # the parent's handler is not the planner's
    os.setpgid(0, 0)  # Ctrl-C is the parent's alone to handle, and what the planner starts can be ended with it
    end_with(parent)
    with contextlib.suppress(OSError):  # where standard error is closed
        os.dup2(2, 1)  # standard output is for the summary, or the one object of --json
    speaker = _Speaker(connection)
    try:
        planner = make(name, **options)
    except MmpError as error:
        speaker.tell(MISUSE, in_words(error))
        return
    except BaseException as error:
        speaker.tell(MISUSE, f"planner '{name}' does not load: {in_words(error)}")
        return
    speaker.tell(MADE, None)
    problem, seed, time_limit, wants_iterates = connection.recv()
    kind, value = _planned(name, planner, problem, seed, time_limit, speaker, wants_iterates)
    flush_output()
    speaker.tell(kind, value)


def _planned(
    name: str,
    planner: Planner,
    problem: Problem,
    seed: int,
    time_limit: float,
    speaker: _Speaker,
    wants_iterates: bool,
) -> tuple[str, Any]:
    result = PlanResult(status=Status.TIMEOUT)
    try:
        with stopping_on_interrupt() as interruption:
            watch = _Forwarder(speaker, interruption, wants_iterates)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            try:
                result = run_planner(name, planner, problem, seed=seed, time_limit=time_limit, watch=watch)
            finally:
                signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    except StopPlanning:
        pass
    except MmpError as error:
        return MISUSE, in_words(error)
    except BaseException as error:  # KeyboardInterrupt: no user's, for that is asked for with StopPlanning
        result = failed(name, f"raised {in_words(error)}")
    return RESULT, result_to_data(result)


class _Speaker:
    """Tells the parent; only from the process that the parent has started, and one message at a time."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._pid, self._lock = connection, os.getpid(), threading.Lock()

    @property
    def is_another_process(self) -> bool:
        return os.getpid() != self._pid

    def tell(self, kind: str, value: Any) -> None:
        if self.is_another_process:  # a fork of the planner's, which has come back out of `plan` as well
            os._exit(0)
        data = kind.encode() + b"\n" + written(value)
        with held_back(), self._lock:
            self._connection.send_bytes(data)


class _Forwarder:
    """The watcher of the planner: hands on the events of `mmp_env.events`, which all watchers know, and no others."""

    def __init__(self, speaker: _Speaker, interruption: Interruption, wants_iterates: bool) -> None:
        self._speaker, self._interruption, self.wants_iterates = speaker, interruption, wants_iterates

    def __call__(self, event: Any) -> None:
        if not is_known(event) or self._speaker.is_another_process:
            return
        self._interruption.check(event)
        with contextlib.suppress(TypeError, AttributeError, pickle.PicklingError):  # it holds more than data
            self._speaker.tell(EVENT, event)
