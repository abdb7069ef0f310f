"""Errors that say what was wrong, what is allowed and what comes nearest to what was asked for."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class MmpError(ValueError):
    """Misuse: a bad file, name, option or value. The message is one sentence for the user; `mmp` exits with 2."""


class UnknownNameError(MmpError):
    """A name that is not registered; the message lists the names that are, the nearest first."""

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        names = sorted(known)
        close = difflib.get_close_matches(str(name), names, n=1, cutoff=0.4)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        super().__init__(f"unknown {kind} '{name}'.{hint} Known: {', '.join(names) or 'none'}")
        self.kind, self.name, self.known = kind, name, names

    def __reduce__(self) -> tuple[type[UnknownNameError], tuple[str, object, list[str]]]:
        return type(self), (self.kind, self.name, self.known)  # worker processes hand their errors on


class InvalidInstanceError(MmpError):
    """A start or goal that is out of limits or in collision: the instance is `invalid`, no planner can solve it."""
