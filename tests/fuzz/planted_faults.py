"""Faults that tests plant into a worker: the fuzzer must find each."""

from __future__ import annotations

import os
import signal
import sys
import time
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


def crashes(line: list[str]) -> None:
    """Ends the process by a signal."""
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
