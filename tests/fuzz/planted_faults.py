"""Faults that tests plant into a worker: the fuzzer must find each."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path


def raises(line: list[str]) -> None:
    """Raises an exception that is not a refusal."""
    raise KeyError(line[0])


def planner_raises(line: list[str]) -> None:
    """Says that a planner raised."""
    print("mmp: planner 'x' raised ValueError: y", file=sys.stderr)
    raise SystemExit(1)


def waits(line: list[str]) -> None:
    """Does not return, and does nothing."""
    time.sleep(3600)


def works(line: list[str]) -> None:
    """Does not return, and uses the processor."""
    while True:
        pass


def works_in_a_child(line: list[str]) -> None:
    """Does not return, and lets a process that it started use the processor."""
    subprocess.run([sys.executable, "-c", "while True: pass"], check=False)


def crashes(line: list[str]) -> None:
    """Ends the process by a signal, after a word to standard error."""
    os.write(2, b"an assertion failed\n")
    os.kill(os.getpid(), signal.SIGSEGV)


def leaves_half_a_file(line: list[str]) -> None:
    """Refuses the command line, and leaves a file."""
    Path("out.json").write_text('{"half": ')
    print("mmp: refused", file=sys.stderr)
    raise SystemExit(2)


def is_silent(line: list[str]) -> None:
    """Refuses the command line without a sentence."""
    raise SystemExit(2)


def accepts_everything(line: list[str]) -> None:
    """Accepts whatever the files say."""
    raise SystemExit(0)


def overwrites(line: list[str]) -> None:
    """Writes into an input file."""
    Path("cell.json").write_text("{}")
    raise SystemExit(0)


def fails_in_silence(line: list[str]) -> None:
    """Says that something is wrong by the exit code alone."""
    raise SystemExit(1)


def refuses_in_many_lines(line: list[str]) -> None:
    """Refuses the command line with a list that has no end."""
    print("\n".join(f"mmp: {k}" for k in range(30)), file=sys.stderr)
    raise SystemExit(2)


def warns(line: list[str]) -> None:
    """Lets Python print a warning."""
    warnings.warn("divided by zero", RuntimeWarning, stacklevel=1)
    raise SystemExit(0)


def writes_past_python(line: list[str]) -> None:
    """Writes to standard error as a library does."""
    os.write(2, b"a library is not content\n")
    raise SystemExit(0)
