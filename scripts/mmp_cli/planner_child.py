"""The child process of `planner_process`: it makes the planner, runs it, and sends events and the result."""

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
from mmp_cli.planner_messages import encode, is_known, result_to_data
from mmp_env.errors import MmpError, in_words
from mmp_env.model.problem import Problem
from mmp_planners import Planner, PlanResult, Status, StopPlanning, make
from mmp_planners.safe_plan import failed, run_planner

MADE, MISUSE, EVENT, RESULT = "made", "misuse", "event", "result"
"""Kinds of messages. A child sends `MADE` or `MISUSE`; then events, and `RESULT` or `MISUSE`."""


@contextlib.contextmanager
def sigint_blocked() -> Iterator[None]:
    """Blocks SIGINT, so that no message is torn."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def serve(connection: Connection, of_parent: Connection, parent: int, name: str, options: Mapping[str, Any]) -> None:
    """Makes the planner and runs it on the problem that arrives. SIGINT is blocked except during planning."""
    of_parent.close()
    for signum in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, signal.SIG_DFL)  # not the handlers of the parent
    os.setpgid(0, 0)  # the parent alone handles Ctrl-C, and ends the whole group
    end_with(parent)
    with contextlib.suppress(OSError):  # standard error may be closed
        os.dup2(2, 1)  # standard output is for the summary or the JSON object
    sender = _Sender(connection)
    try:
        planner = make(name, **options)
    except MmpError as error:
        sender.send(MISUSE, in_words(error))
        return
    except BaseException as error:
        sender.send(MISUSE, f"planner '{name}' does not load: {in_words(error)}")
        return
    sender.send(MADE, None)
    problem, seed, time_limit, wants_iterates = connection.recv()
    kind, value = _planned(name, planner, problem, seed, time_limit, sender, wants_iterates)
    flush_output()
    sender.send(kind, value)


def _planned(
    name: str,
    planner: Planner,
    problem: Problem,
    seed: int,
    time_limit: float,
    sender: _Sender,
    wants_iterates: bool,
) -> tuple[str, Any]:
    result = PlanResult(status=Status.TIMEOUT)
    try:
        with stopping_on_interrupt() as interruption:
            watch = _Forwarder(sender, interruption, wants_iterates)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            try:
                result = run_planner(name, planner, problem, seed=seed, time_limit=time_limit, watch=watch)
            finally:
                signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    except StopPlanning:
        pass
    except MmpError as error:
        return MISUSE, in_words(error.__cause__ or error)  # the parent names the planner
    except BaseException as error:  # a KeyboardInterrupt is not the user's, who causes StopPlanning
        result = failed(name, f"raised {in_words(error)}")
    return RESULT, result_to_data(result)


class _Sender:
    """Sends messages to the parent, one at a time, and only from the process that the parent has started."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._pid, self._lock = connection, os.getpid(), threading.Lock()

    @property
    def is_another_process(self) -> bool:
        return os.getpid() != self._pid

    def send(self, kind: str, value: Any) -> None:
        if self.is_another_process:  # a fork that the planner made and that returned from `plan` too
            os._exit(0)
        data = kind.encode() + b"\n" + encode(value)
        with sigint_blocked(), self._lock:
            self._connection.send_bytes(data)


class _Forwarder:
    """The planner's watcher: it forwards the events of `mmp_env.events`, which all watchers know, and no others."""

    def __init__(self, sender: _Sender, interruption: Interruption, wants_iterates: bool) -> None:
        self._sender, self._interruption, self.wants_iterates = sender, interruption, wants_iterates

    def __call__(self, event: Any) -> None:
        if not is_known(event) or self._sender.is_another_process:
            return
        self._interruption.check(event)
        with contextlib.suppress(TypeError, AttributeError, pickle.PicklingError):  # the event holds more than data
            self._sender.send(EVENT, event)
