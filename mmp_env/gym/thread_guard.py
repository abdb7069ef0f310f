"""Refuses an environment to a second thread while a first one uses it, because MuJoCo crashes on shared data."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, runtime_checkable

from mmp_env.errors import MmpError


class ThreadGuard:
    """A context that one thread at a time can enter, also several times. Another thread gets an error and never waits.

    A copy is free, because it guards a copy of the environment.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        """Raises `MmpError` if another thread is inside."""
        if not self._lock.acquire(blocking=False):
            raise MmpError("the environment is in use by another thread; give each thread its own environment")

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[Any, ...]:
        return ThreadGuard, ()


@runtime_checkable
class Guarded(Protocol):
    """An object with a guard."""

    thread_guard: ThreadGuard


P = ParamSpec("P")
T = TypeVar("T")
G = TypeVar("G", bound=Guarded)


def one_thread_at_a_time(method: Callable[Concatenate[G, P], T]) -> Callable[Concatenate[G, P], T]:
    """Makes a method raise `MmpError` while another thread is in a guarded method of the same object."""

    @functools.wraps(method)
    def guarded(self: G, /, *args: P.args, **keywords: P.kwargs) -> T:
        with self.thread_guard:
            return method(self, *args, **keywords)

    return guarded
