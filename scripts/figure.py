"""A measured figure as one line of JSON, which all `bench_*.py` print; docs/results/figures.jsonl is made of them."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from mmp_cli.machine import machine, version

ROOT = Path(__file__).parent.parent


def print_figure(
    name: str, value: float, unit: str, *, ratio: float | None = None, ratio_to: str | None = None, **more: Any
) -> None:
    """Prints a figure. `ratio` says how it compares with `ratio_to`; `more` are further keys of the line."""
    line: dict[str, Any] = {"name": name, "value": rounded(value), "unit": unit}
    if ratio is not None:
        line |= {"ratio": rounded(ratio), "ratio_to": ratio_to}
    print(json.dumps(line | more | {"cpu": machine(), "version": version(), "commit": commit()}), flush=True)


@cache
def commit() -> str | None:
    """The commit of the checkout, with `-dirty` where files differ from it; None outside of Git."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"]
    try:
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def rounded(value: float) -> float | int:
    """Four significant digits: no timing is better than that. Whole numbers stay as they are."""
    return value if isinstance(value, int) else float(f"{value:.4g}")


def timed(call: Callable[[], object], repeats: int) -> list[float]:
    """Wall-clock times [s] of `repeats` calls, shortest first: on a busy machine the shortest says most."""
    out = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        out.append(time.perf_counter() - begin)
    return sorted(out)
