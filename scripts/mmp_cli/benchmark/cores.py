"""Which core a worker stays on, such that two benchmarks on one machine do not share one while others idle."""

from __future__ import annotations

import contextlib
import os
import socket

_NAME = "\0mmp-bench-core-{}"
"""A name in Linux's list of abstract sockets: taken by one process at a time, and free when that ends, however."""


class Core:
    """A core of this machine that nobody else here has claimed; `number` is None where all are, or cores have none."""

    def __init__(self) -> None:
        self.number: int | None = None
        self._claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        for number in sorted(available()):
            with contextlib.suppress(OSError):
                self._claim.bind(_NAME.format(number))
                self.number = number
                return

    def free(self) -> None:
        """Gives it back."""
        self._claim.close()


def available() -> set[int]:
    """The cores that this process may use; empty where that cannot be asked."""
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()


def count() -> int:
    """How many processes can run at once."""
    return len(available()) or os.cpu_count() or 1
