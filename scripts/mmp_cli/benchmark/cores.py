"""Assignment of workers to cores, so that two benchmarks on one machine do not share a core while others idle."""

from __future__ import annotations

import contextlib
import os
import socket

_NAME = "\0mmp-bench-core-{}"
"""Name of an abstract socket of Linux, which one process can hold, and which is free when that process ends."""


class Core:
    """A core that no other process has claimed; `number` is None if all are claimed or cores have no numbers."""

    def __init__(self) -> None:
        self.number: int | None = None
        self._claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        for number in sorted(available()):
            with contextlib.suppress(OSError):
                self._claim.bind(_NAME.format(number))
                self.number = number
                return

    def free(self) -> None:
        """Releases the core."""
        self._claim.close()


def available() -> set[int]:
    """Returns the cores that this process may use; empty if the system does not say."""
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()


def count() -> int:
    """Returns how many processes can run at once."""
    return len(available()) or os.cpu_count() or 1
