"""What runs in a worker process: it takes tasks from its connection, does them and sends the answers.

The process is started with the number of a file descriptor. It ends by itself when the one that started it does.
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
"""Environment variables that keep libraries from starting threads; they hold only when set before a process starts."""
_PR_SET_PDEATHSIG = 1


def main(descriptor: int, parent: int, core: int | None) -> None:
    """Serves until the connection ends. `parent` is the process that started this one, `core` the one to stay on."""
    end_with(parent)
    faulthandler.enable()
    if core is not None:
        with contextlib.suppress(OSError):
            os.sched_setaffinity(0, {core})
    with contextlib.suppress(OSError):  # where memory runs out, the system shall end a worker and nothing else
        Path("/proc/self/oom_score_adj").write_text("1000")
    from mmp_cli.benchmark.trial import Trials

    connection = Connection(descriptor)
    line = Line(connection)
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        serve(line, Trials(connection.recv(), line.send))


class Line:
    """What a worker speaks through: each message carries the number of the task, and comes from the worker itself."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._number, self._pid = connection, 0, os.getpid()

    def receive(self) -> Task:
        """The next task. Raises EOFError when nothing more can come."""
        self._number, task = self._connection.recv()
        return task

    def send(self, message: Answer | str) -> None:
        """Sends it. A fork that a planner made, and that came back out of `plan` as well, ends here."""
        if os.getpid() != self._pid:
            os._exit(0)
        self._connection.send((self._number, message))


def serve(line: Line, trials: Trials) -> None:
    """Does what comes. Raises EOFError when nothing more can come."""
    from mmp_cli.benchmark.job import Unit

    line.send(READY)
    while True:
        task = line.receive()
        answer = trials.run(task) if isinstance(task, Unit) else trials.examine(task.planner)
        flush_output()
        line.send(answer)


def flush_output() -> None:
    """Writes what planners have printed."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):  # a planner may have closed them
            stream.flush()


def end_with(parent: int) -> None:
    """Lets the system kill this process when the one that started it is gone, however that ended."""
    with contextlib.suppress(OSError, AttributeError):  # Linux has it; elsewhere the end of the connection must do
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
