"""Calls a function in a forked child process: code of other packages can then do no harm to this one."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import signal
import time
import warnings
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from typing import Any

from mmp_cli.benchmark.worker import end_with, flush_output
from mmp_cli.pipe_reader import PipeReader
from mmp_cli.process_status import how_it_ended
from mmp_env.errors import MmpError, in_words

LIMIT_S = 60.0
"""Default of the longest time of a call [s]."""
_TICK_S = 0.1


def call_in_child(function: Callable[[str], Any], argument: str, *, limit_s: float | None = None) -> Any:
    """Returns what `function` returns in a child process, as JSON has it.

    Args:
        function: the function.
        argument: its argument.
        limit_s: longest time of the call [s]; None: `LIMIT_S`.

    Raises:
        MmpError: if the function raises, if its process ends, or if it takes longer than `limit_s`.
    """
    fork = multiprocessing.get_context("fork")
    connection, theirs = multiprocessing.Pipe(duplex=False)
    process = fork.Process(target=_serve, args=(theirs, os.getpid(), function, argument))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # Python 3.12 sees the idle threads of BLAS
            process.start()
        theirs.close()
        return _answer(process, connection, LIMIT_S if limit_s is None else limit_s)
    finally:
        if process.pid is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.kill()
            process.join()
        connection.close()


def _serve(connection: Connection, parent: int, function: Callable[[str], Any], argument: str) -> None:
    for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, signal.SIG_DFL)
    os.setpgid(0, 0)
    end_with(parent)
    with contextlib.suppress(OSError):  # where standard error is closed
        os.dup2(2, 1)  # standard output is for the answer of the command
    child = os.getpid()
    try:
        answer = {"value": function(argument)}
    except BaseException as error:
        answer = {"error": in_words(error)}
    if os.getpid() != child:  # a fork that the function has made
        os._exit(0)
    flush_output()
    connection.send_bytes(json.dumps(answer).encode())


def _answer(process: Any, connection: Any, limit_s: float) -> Any:
    """Returns the value in the answer of the child. Raises `MmpError` as `call_in_child` does."""
    messages, until = PipeReader(connection.fileno()), time.monotonic() + limit_s
    try:
        while (message := messages.next()) is None:
            if time.monotonic() > until:
                raise MmpError(f"its process was ended: it did not answer within {limit_s:g} s")
            wait([connection, process.sentinel], timeout=_TICK_S)
            if not process.is_alive() and not connection.poll():
                raise EOFError
        answer = json.loads(message)
    except (EOFError, OSError):
        process.join(_TICK_S)
        how = "closed its connection" if process.exitcode is None else how_it_ended(process.exitcode)
        raise MmpError(f"its process {how}") from None
    except ValueError as error:
        if isinstance(error, MmpError):
            raise
        raise MmpError("its process sent an answer that cannot be read") from None
    if "error" in answer:
        raise MmpError(answer["error"])
    return answer["value"]
