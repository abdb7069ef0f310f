"""A worker process that is ended when it does not answer, and started again."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
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
        self._said = Path(self._home.name, "stderr")
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
            if reason := _hang(process, seconds, self._place):
                self._stop()
                raise Fault(reason)
            line = process.stdout.readline()
        except BrokenPipeError:
            pass
        if not line:
            code = process.wait()
            self._stop()
            end = f"signal {-code}" if code < 0 else f"code {code}"
            raise Fault(f"the process ended with {end}{_last_lines(self._said)}")
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
            children = _descendants(self._process.pid)
            self._process.kill()
            self._process.communicate()
            for child in children:
                with contextlib.suppress(OSError):
                    os.kill(child, signal.SIGKILL)
            self._process = None

    def _start(self) -> subprocess.Popen[str]:
        env = dict(os.environ, PYTHONPATH=_path(), MUJOCO_GL="disabled")
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):  # without them, nothing can open a window
            env.pop(name, None)
        for name in ("data", "cache"):
            env[f"XDG_{name.upper()}_HOME"] = f"{self._home.name}/{name}"
        command = [sys.executable, "-m", "fuzz.worker", str(self._place)]
        with self._said.open("ab") as said:
            return subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=said, text=True, env=env
            )


def _hang(process: subprocess.Popen[str], seconds: float, place: Path) -> str:
    """Waits until a process answers. Returns why it does not: it has worked for `seconds`, or slept for much longer.

    Each call of the core has these seconds; `place` has its number.
    """
    begin, begin_cpu, number = time.monotonic(), _processor_time(process.pid), place.read_bytes()
    while not select.select([process.stdout], [], [], min(seconds, 1.0))[0]:
        if (now := place.read_bytes()) != number:
            begin, begin_cpu, number = time.monotonic(), _processor_time(process.pid), now
        if _processor_time(process.pid) - begin_cpu >= seconds:
            return f"no answer within {seconds:g} s of processor time"
        if time.monotonic() - begin >= _PATIENCE * seconds:
            return f"no answer within {_PATIENCE * seconds:g} s"
    return ""


def _processor_time(pid: int) -> float:
    """Returns the processor time that a process and its children have used [s], also those that have ended."""
    ticks = sum(sum(map(int, words[11:15])) for words in map(_stat, [pid, *_descendants(pid)]) if words)
    return ticks / os.sysconf("SC_CLK_TCK")


def _descendants(pid: int) -> list[int]:
    """Returns the processes that a process has started, and those that they have started."""
    out = []
    for children in Path("/proc", str(pid), "task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in map(int, children.read_text(encoding="ascii").split()):
                out += [child, *_descendants(child)]
    return out


def _stat(pid: int) -> list[str]:
    """Returns the words of the state of a process after its name; nothing once it has ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace").rsplit(")", 1)[1].split()
    except OSError:
        return []


def _last_lines(path: Path, count: int = 3) -> str:
    """Returns the last lines of a text after a colon; nothing if it is empty."""
    lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-count:]
    return "".join(f": {line}" for line in lines)


def _path() -> str:
    return os.pathsep.join(filter(None, [str(TESTS), os.environ.get("PYTHONPATH", "")]))
