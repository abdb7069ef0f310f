"""The program of a worker process: it receives tasks, runs them, and sends the answers.

Its argument is the number of a file descriptor. It ends when its parent process ends.
"""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import os
import signal
import sys
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mmp_cli.benchmark.job import Answer, Task
    from mmp_cli.benchmark.trial import Trials

READY = "ready"
_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "BLIS")
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in _LIBRARIES}
"""Environment variables that keep libraries from starting threads; they must be set before a process starts."""
_PR_SET_PDEATHSIG = 1


def main(descriptor: int, parent: int, core: int | None) -> None:
    """Serves until the connection ends. `parent` is the process that started this one, `core` the core to stay on."""
    end_with(parent)
    faulthandler.enable()
    if core is not None:
        with contextlib.suppress(OSError):
            os.sched_setaffinity(0, {core})
    with contextlib.suppress(OSError):  # out of memory, the system shall end a worker and nothing else
        Path("/proc/self/oom_score_adj").write_text("1000")
    from mmp_cli.benchmark.trial import Trials

    connection = Connection(descriptor)
    tasks = TaskConnection(connection)
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        serve(tasks, Trials(connection.recv(), tasks.send))


class TaskConnection:
    """The connection of a worker. Each message carries the number of the task; only the worker itself sends."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._number, self._pid = connection, 0, os.getpid()

    def receive(self) -> Task:
        """Returns the next task. Raises `EOFError` when the connection has ended."""
        self._number, task = self._connection.recv()
        return task

    def send(self, message: Answer | str) -> None:
        """Sends a message. A fork that a planner made and that returned from `plan` too ends here."""
        if os.getpid() != self._pid:
            os._exit(0)
        self._connection.send((self._number, message))


def serve(tasks: TaskConnection, trials: Trials) -> None:
    """Runs the tasks that arrive. Raises `EOFError` when the connection has ended."""
    from mmp_cli.benchmark.job import Unit

    tasks.send(READY)
    while True:
        task = tasks.receive()
        answer = trials.run(task) if isinstance(task, Unit) else trials.examine(task.planner)
        flush_output()
        tasks.send(answer)


def flush_output() -> None:
    """Flushes the output of planners."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):  # a planner may have closed them
            stream.flush()


def end_with(parent: int) -> None:
    """Lets the system kill this process when its parent ends."""
    with contextlib.suppress(OSError, AttributeError):  # elsewhere than on Linux the end of the connection must do
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
