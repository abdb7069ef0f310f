"""A process of its own for a planner of another package. Whatever the planner does, it ends in a result or a sentence.

The process is forked before the planner is imported, and its answer is data: no foreign code runs in this process.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import pickle
import signal
import time
import warnings
from collections.abc import Mapping
from multiprocessing.connection import wait
from typing import Any

from mmp_cli.pipe_reader import PipeReader
from mmp_cli.planner_child import EVENT, MISUSE, serve, sigint_blocked
from mmp_cli.planner_messages import decode, result_from_data
from mmp_cli.process_status import how_it_ended, memory_mb
from mmp_env.errors import MmpError
from mmp_env.events import Event, Watcher, ignore, wants_iterates
from mmp_env.model.problem import Problem
from mmp_planners import PlanResult, StopPlanning
from mmp_planners.safe_plan import failed

GRACE_S, GRACE_SHARE = 5.0, 0.1
"""Time that a planner may take beyond its time limit: seconds, and a share of the limit."""
_TICK_S = 0.1


def grace_s(time_limit: float) -> float:
    """Returns how long after its time limit a planner is ended [s]."""
    return GRACE_S + GRACE_SHARE * time_limit


class PlannerProcess:
    """A planner in a process of its own: a `Planner` that plans once, and a context manager.

    Entering it makes the planner, and raises `MmpError` if that fails. The process is ended if it uses more than
    `memory_limit_mb`.
    """

    def __init__(self, name: str, options: Mapping[str, Any], *, memory_limit_mb: int | None = None) -> None:
        self._name, self._phase = name, "loading"
        self._memory_limit_mb = math.inf if memory_limit_mb is None else memory_limit_mb
        self._asked_to_stop, self._limit_s, self._until = False, math.inf, math.inf
        self._next_look = 0.0
        self._inbox: tuple[str, Any] | None = None
        self._connection, theirs = multiprocessing.Pipe()
        self._messages = PipeReader(self._connection.fileno())
        fork = multiprocessing.get_context("fork")
        self._process = fork.Process(target=serve, args=(theirs, self._connection, os.getpid(), name, dict(options)))
        with sigint_blocked(), warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", DeprecationWarning
            )  # the threads that Python 3.12 sees are idle ones of BLAS
            self._process.start()
        theirs.close()

    def __enter__(self) -> PlannerProcess:
        try:
            kind, value = self._next()
            if kind == MISUSE:
                raise MmpError(value)
        except _LostError as error:
            self._end()
            raise MmpError(f"planner '{self._name}' does not load: {error}") from None
        except BaseException:
            self._end()
            raise
        self._inbox, self._phase = None, "planning"
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def plan(
        self, problem: Problem, *, seed: int = 0, time_limit: float = math.inf, watch: Watcher = ignore
    ) -> PlanResult:
        """Returns the planner's result for its copy of the problem. Raises `MmpError` if the planner reports misuse."""
        self._limit_s, self._until = time_limit, time.monotonic() + time_limit + grace_s(time_limit)
        is_sent = False
        while True:
            try:
                if not is_sent:
                    with sigint_blocked(), contextlib.suppress(OSError):  # the end of the process is noticed below
                        is_sent = True
                        self._connection.send((problem, seed, time_limit, wants_iterates(watch)))
                kind, value = self._next()
                if kind == MISUSE:
                    raise MmpError(value)
                if kind != EVENT:
                    return result_from_data(value, problem)
                self._inbox = None
                self._show(value, watch)
            except StopPlanning:  # from a watcher, or as Ctrl-C
                self._ask_to_stop()
            except _LostError as error:
                return failed(self._name, f"gave no answer: {error}")

    def _next(self) -> tuple[str, Any]:
        """Returns the next message. It stays in the inbox, so that Ctrl-C loses none. Raises `_LostError`."""
        while self._inbox is None:
            ended = self._process.exitcode  # asked before reading, so that its last messages are read
            with sigint_blocked():
                self._receive()
            silent = self._inbox is None and not wait([self._connection], timeout=_TICK_S if ended is None else 0)
            if silent and ended is not None:
                raise _LostError(f"its process {how_it_ended(ended)} while {self._phase}")
            self._check_memory()
            # An event is no answer: a planner that sends events for ever is late too.
            if time.monotonic() > self._until and (self._inbox is None or self._inbox[0] == EVENT):
                self._inbox = None
                grace = f"{grace_s(self._limit_s):g} s after its time limit of {self._limit_s:g} s"
                raise _LostError(f"its process was ended, still planning {grace}")
        return self._inbox

    def _check_memory(self) -> None:
        if self._process.pid is None or self._memory_limit_mb == math.inf or time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + _TICK_S
        if (used_mb := memory_mb(self._process.pid)) > self._memory_limit_mb:
            self._inbox = None
            used = f"it used {used_mb:.0f} MB while {self._phase}, over the memory limit of {self._memory_limit_mb} MB"
            raise _LostError(f"its process was ended: {used}")

    def _receive(self) -> None:
        try:
            message = self._messages.next()
            if message is None:
                return
            kind, data = message.split(b"\n", 1)
            if kind == EVENT.encode():
                with contextlib.suppress(pickle.UnpicklingError):  # an event that holds more than data is ignored
                    self._inbox = EVENT, decode(data)
            else:
                self._inbox = kind.decode(), decode(data)
        except (EOFError, OSError):
            self._process.join(_TICK_S)
            code = self._process.exitcode
            how = "closed its connection" if code is None else how_it_ended(code)
            raise _LostError(f"its process {how} while {self._phase}") from None
        except Exception as error:  # foreign bytes may cause any exception
            raise _LostError(f"its process sent an unreadable message ({type(error).__name__})") from None

    def _show(self, event: Event, watch: Watcher) -> None:
        """Passes an event to the watcher and extends the deadline by the time that the watcher takes."""
        begin = time.monotonic()
        try:
            watch(event)
        finally:
            self._until += time.monotonic() - begin

    def _ask_to_stop(self) -> None:
        if not self._asked_to_stop and self._process.pid is not None:
            self._asked_to_stop = True
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._process.pid, signal.SIGINT)

    def _end(self) -> None:
        """Ends the process and its process group."""
        if self._process.pid is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.kill()
            self._process.join()
        self._connection.close()


class _LostError(Exception):
    """No answer can arrive any more; the message says why."""
