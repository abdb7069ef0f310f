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
LONGEST_S = float(os.environ.get("FUZZ_LONGEST_S", "10"))
"""Longest processor time for a command line or a call of the core [s]; sanitizers need more."""
_FIRST_S = 60.0
"""Longest processor time until a new process has imported everything [s]."""
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

    def ask(self, request: dict[str, Any], patience: float = 1.0) -> dict[str, Any]:
        """Returns the answer to a request, which may take `patience` times as long as usual.

        Raises `Fault`, after which a new process answers.
        """
        if self._process is None:
            self._process = self._start()
            self._answer(self._process, {"line": ["list"], "folder": self._home.name}, _FIRST_S)
        return self._answer(self._process, request, patience * self._longest_s)

    def _answer(self, process: subprocess.Popen[str], request: dict[str, Any], seconds: float) -> dict[str, Any]:
        assert process.stdin is not None
        assert process.stdout is not None
        line = ""
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            if not _answers(process, seconds, self._place):
                self._stop()
                raise Fault(f"no answer within {seconds:g} s")
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
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):  # without them, nothing can open a window
            env.pop(name, None)
        for name in ("data", "cache"):
            env[f"XDG_{name.upper()}_HOME"] = f"{self._home.name}/{name}"
        command = [sys.executable, "-m", "fuzz.worker", str(self._place)]
        return subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=env
        )


def _answers(process: subprocess.Popen[str], seconds: float, place: Path) -> bool:
    """Waits until a process answers. Returns False if it has worked for `seconds` without, or slept for much longer.

    Each call of the core has these seconds; `place` has its number.
    """
    begin, begin_cpu, number = time.monotonic(), _processor_time(process), place.read_bytes()
    while not select.select([process.stdout], [], [], min(seconds, 1.0))[0]:
        if (now := place.read_bytes()) != number:
            begin, begin_cpu, number = time.monotonic(), _processor_time(process), now
        if _processor_time(process) - begin_cpu >= seconds or time.monotonic() - begin >= _PATIENCE * seconds:
            return False
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
