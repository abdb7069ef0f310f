"""Memory use of a process, and the reason of its end in words."""

from __future__ import annotations

import os
import signal
from pathlib import Path

_MB = 2**20
_WORDS = {"SIGSEGV": " (it crashed)", "SIGKILL": " (out of memory, or by hand)"}


def how_it_ended(code: int) -> str:
    """Returns in words how a process ended, from its exit code or from minus the number of a signal."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"was killed by signal {-code}"
    return f"was killed by {name}{_WORDS.get(name, '')}"


def memory_mb(pid: int) -> float:
    """Returns the resident memory of a process [MB], or 0 where the system does not say."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / _MB
