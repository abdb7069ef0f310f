"""Calls in which Ctrl-C is pressed."""

from __future__ import annotations

import importlib
import signal
from typing import Any

import pytest


def interrupting(monkeypatch: pytest.MonkeyPatch, function: str, times: int = 1) -> None:
    """Lets a function raise SIGINT some times, each time before it does its work."""
    module, _, name = function.rpartition(".")
    whole = getattr(importlib.import_module(module), name)

    def interrupted(*args: Any, **kwargs: Any) -> Any:
        for _ in range(times):
            signal.raise_signal(signal.SIGINT)
        return whole(*args, **kwargs)

    monkeypatch.setattr(function, interrupted)
