"""What a result was made with: the version and the machine."""

from __future__ import annotations

import functools
import os
import platform
from importlib import metadata
from pathlib import Path


@functools.cache
def version() -> str:
    """The installed version of mmp-env."""
    return metadata.version("mmp-env")


@functools.cache
def machine() -> str:
    """Model of the processor and number of its cores."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    model = models[0] if models else platform.processor() or platform.machine()
    return f"{model}, {os.cpu_count()} cores"
