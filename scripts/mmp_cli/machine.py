"""Version of mmp-env and description of the machine, which results state."""

from __future__ import annotations

import functools
import os
import platform
from pathlib import Path

import mmp_env


def version() -> str:
    """Returns the version of mmp-env."""
    return mmp_env.__version__


@functools.cache
def machine() -> str:
    """Returns the model of the processor and the number of its cores."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    model = models[0] if models else platform.processor() or platform.machine()
    return f"{model}, {os.cpu_count()} cores"


def load() -> float | None:
    """Returns the mean number of running processes over the last minute, all users; None if the system has none."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None
