"""A slot for a worker process. It replaces a worker that ends, hangs or exceeds its memory limit."""

from __future__ import annotations

import contextlib
import os
import pickle
import re
import signal
import socket
import subprocess
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from mmp_cli.benchmark.cores import Core
from mmp_cli.benchmark.job import Answer, Failure, Job, Task
from mmp_cli.benchmark.worker import ONE_THREAD, READY
from mmp_cli.machine import machine
from mmp_cli.pipe_reader import PipeReader
from mmp_cli.process_status import how_it_ended, memory_mb
from mmp_env.files.temporaries import unnamed_file

TICK_S = 0.05
"""Time between two looks at a worker [s]."""
GRACE_LEAST_S, GRACE_MOST_S = 2.0, 30.0
PREPARING_S, CHECKING_S = 120.0, 600.0
"""Time limits of a unit before and after planning [s]."""
_STARTS = 2
"""Number of starts of a worker for a task; the first one may have been killed from outside."""
_PROGRAM = "import sys; sys.path[:] = {path!r}; from mmp_cli.benchmark.worker import main; main({fd}, {parent}, {core})"
_FRAME = re.compile(r'File "([^<].*)", line (\d+) in (\S+)')
_TAIL_BYTES = 65536


def grace_s(time_limit_s: float) -> float:
    """Returns how long after its time limit a planner is killed [s]: the limit again, from 2 s to 30 s."""
    return min(max(time_limit_s, GRACE_LEAST_S), GRACE_MOST_S)


class WorkerSlot:
    """One worker at a time: `give` it a task, then `look` until there is an answer; `close` ends it.

    Each task has a number that comes back with the answer, so that an answer to an earlier task is ignored.
    """

    def __init__(self, job: Job) -> None:
        self._log = unnamed_file()  # the output of planners; its end says why a worker crashed
        self._job, self._core = job, Core()
        self._process: subprocess.Popen | None = None
        self._ready, self._starts = False, 0
        self._number, self._task = 0, None
        self._phase, self._until = "", 0.0

    @property
    def connection(self) -> Connection:
        """Returns the connection to wait for: it is readable when `look` may have an answer."""
        return self._connection

    def give(self, task: Task) -> None:
        """Passes a task to the worker, and starts one if there is none."""
        if self._process is not None and self._process.poll() is not None:
            self._kill()  # it ended after its last answer; this task is not the cause
        self._number, self._task, self._starts = self._number + 1, task, 0
        if self._process is None:
            self._start()
        self._hand_over()

    def _hand_over(self) -> None:
        self._enter("preparing")
        with contextlib.suppress(OSError):  # `look` notices a worker that has ended
            self._connection.send((self._number, self._task))

    def look(self) -> Answer | None:
        """Returns the answer, or None if there is none yet. A worker that ends at its start is started once more."""
        assert self._process is not None
        ended = self._process.poll()  # asked before reading, so that its last messages are read
        with contextlib.suppress(EOFError, OSError, ValueError, TypeError, pickle.UnpicklingError):
            while (received := self._messages.next()) is not None:
                number, message = pickle.loads(received)
                if message == READY:
                    self._ready = True
                elif number != self._number:
                    continue
                elif isinstance(message, str):
                    self._enter(message)
                else:
                    return self._done(message)
        reason = self._end(ended) if ended is not None else self._exceeded_limit()
        if reason is None:
            return None
        self._kill()
        if self._ready:
            return Failure(message=reason, machine=machine())
        if self._starts < _STARTS:
            self._start()
            self._hand_over()
            return None
        message = f"a worker process does not start: {reason}; its last output: {self._last_line()}"
        return Failure(message=message, machine=machine(), started=False)

    def close(self) -> None:
        """Ends the worker and frees its core."""
        self._kill()
        self._core.free()
        self._log.close()

    def _start(self) -> None:
        self._starts += 1
        ours, theirs = socket.socketpair()
        self._connection = Connection(ours.detach())
        self._messages = PipeReader(self._connection.fileno())
        program = _PROGRAM.format(path=sys.path, fd=theirs.fileno(), parent=os.getpid(), core=self._core.number)
        self._empty_log()
        with theirs:
            # A process group of its own: only this process handles Ctrl-C, and the whole group can be ended.
            self._process = subprocess.Popen(
                [sys.executable, "-c", program],
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                pass_fds=[theirs.fileno()],
                env=os.environ | ONE_THREAD,
                process_group=0,
            )
        self._ready = False
        with contextlib.suppress(OSError):
            self._connection.send(self._job)

    def _enter(self, phase: str) -> None:
        limit_s = self._job.time_limit_s
        allowed = {"preparing": PREPARING_S, "planning": limit_s + grace_s(limit_s), "checking": CHECKING_S}
        self._phase, self._until = phase, time.monotonic() + allowed[phase]

    def _done(self, answer: Any) -> Answer:
        self._empty_log()
        if self._memory_mb() > self._job.memory_limit_mb / 2:
            self._kill()  # the memory of this unit must not count for the next one
        return answer

    def _empty_log(self) -> None:
        # The worker shares the descriptor: the output of its next unit starts at the beginning again.
        with contextlib.suppress(OSError):  # earlier output may stay: only its end is read
            os.lseek(self._log.fileno(), 0, os.SEEK_SET)
            os.ftruncate(self._log.fileno(), 0)

    def _exceeded_limit(self) -> str | None:
        """Returns which limit the worker exceeds, or None."""
        if time.monotonic() > self._until:
            if self._phase != "planning":
                return f"killed: it was still {self._phase} after {CHECKING_S if self._ready else PREPARING_S:g} s"
            limit_s = self._job.time_limit_s
            return f"killed: still planning {grace_s(limit_s):g} s after its time limit of {limit_s:g} s"
        used_mb, limit_mb = self._memory_mb(), self._job.memory_limit_mb
        if used_mb > limit_mb:
            return f"killed: it used {used_mb:.0f} MB while {self._phase}, over the memory limit of {limit_mb} MB"
        return None

    def _end(self, code: int) -> str:
        """Returns why the worker ended, from its exit code and the output of the fault handler."""
        return f"the worker process {how_it_ended(code)} while {self._phase}{self._frame()}"

    def _frame(self) -> str:
        found = _FRAME.search(self._tail().partition("(most recent call first)")[2])
        return f", in {found[3]} ({Path(found[1]).name}, line {found[2]})" if found else ""

    def _last_line(self) -> str:
        lines = self._tail().strip().splitlines()
        return lines[-1] if lines else "none"

    def _tail(self) -> str:
        descriptor = self._log.fileno()
        begin = max(0, os.fstat(descriptor).st_size - _TAIL_BYTES)
        return os.pread(descriptor, _TAIL_BYTES, begin).decode(errors="replace")

    def _memory_mb(self) -> float:
        assert self._process is not None
        return memory_mb(self._process.pid)

    def _kill(self) -> None:
        if self._process is None:
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._connection.close()
        self._process = None
