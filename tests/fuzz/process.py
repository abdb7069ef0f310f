"""A worker process that is ended when it does not answer, and started again."""

from __future__ import annotations

import json
import os
import select
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parents[1]
LONGEST_S = 10.0
"""Longest processor time for an answer [s]; the first one of a process may take longer, since it imports everything."""
_FIRST_S = 60.0
_PATIENCE = 6.0
"""Longest wall-clock time for an answer, relative to the processor time: the machine may do other work."""


class Fault(Exception):
    """A worker that crashed or did not answer; the message says which."""


class Worker:
    """A process of `worker.py`, which has `longest_s` for an answer [s]."""

    def __init__(self, longest_s: float = LONGEST_S) -> None:
        self._longest_s = longest_s
        self._home = tempfile.TemporaryDirectory(prefix="fuzz-")
        self._place = Path(self._home.name, "number")
        self._place.write_bytes(bytes(8))
        self._process: subprocess.Popen[str] | None = None

    def ask(self, request: dict[str, Any], allowed_s: float = 0.0) -> dict[str, Any]:
        """Returns the answer to a request. Raises `Fault`, after which a new process answers."""
        fresh = self._process is None
        process = self._process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        line = ""
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            seconds = self._longest_s + allowed_s + (_FIRST_S if fresh else 0.0)
            if not _answers(process, seconds):
                self._stop()
                raise Fault(f"no answer within {self._longest_s:g} s")
            line = process.stdout.readline()
        except BrokenPipeError:
            pass
        if not line:
            code = process.wait()
            self._stop()
            raise Fault(f"the process ended with signal {-code}" if code < 0 else f"the process ended with code {code}")
        return json.loads(line)

    @property
    def number(self) -> int:
        """The number of the call of the core that ran last."""
        return struct.unpack("q", self._place.read_bytes())[0]

    def close(self) -> None:
        """Ends the process, and removes its files. The worker is not used again."""
        self._stop()
        self._home.cleanup()

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _start(self) -> subprocess.Popen[str]:
        env = dict(os.environ, PYTHONPATH=_path(), MUJOCO_GL="disabled")
        for name in ("data", "cache"):
            env[f"XDG_{name.upper()}_HOME"] = f"{self._home.name}/{name}"
        command = [sys.executable, "-m", "fuzz.worker", str(self._place)]
        return subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=env
        )


def _answers(process: subprocess.Popen[str], seconds: float) -> bool:
    """Waits until a process answers. Returns False if it has worked for `seconds` without, or slept for much longer."""
    begin, begin_cpu = time.monotonic(), _processor_time(process)
    step = seconds
    while not select.select([process.stdout], [], [], step)[0]:
        left = seconds - (_processor_time(process) - begin_cpu)
        if left <= 0 or time.monotonic() - begin >= _PATIENCE * seconds:
            return False
        step = max(left, 0.1)
    return True


def _processor_time(process: subprocess.Popen[str]) -> float:
    """Returns the processor time that a process has used [s], 0 once it has ended."""
    try:
        words = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def _path() -> str:
    return os.pathsep.join(filter(None, [str(TESTS), os.environ.get("PYTHONPATH", "")]))
