"""Computations in short steps, for callers that have little time at once."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeAlias, TypeVar

T = TypeVar("T")
Steps: TypeAlias = Generator[None, None, T]
"""A computation that yields after each of its steps, a few milliseconds long, and returns its result."""


def finished(steps: Steps[T]) -> T:
    """Returns the result of all steps."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
