"""How a process ended, in words."""

from __future__ import annotations

import signal

_WORDS = {"SIGSEGV": " (it crashed)", "SIGKILL": " (out of memory, or by hand)"}


def how_it_ended(code: int) -> str:
    """Returns the words for an exit code as Python has it: that of the process, or minus the number of a signal."""
    if code >= 0:
        return f"ended by itself with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"was killed by signal {-code}"
    return f"was killed by {name}{_WORDS.get(name, '')}"
