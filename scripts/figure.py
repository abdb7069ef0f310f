"""A measured figure as a line of JSON. All `bench_*.py` print such lines, and docs/results/figures.jsonl has them."""

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
    """Prints a figure. `ratio` is relative to what `ratio_to` names; `more` are further keys of the line."""
    if ratio is not None:
        more = {"ratio": rounded(ratio), "ratio_to": ratio_to} | more
    print(json.dumps(figure_line(name, rounded(value), unit, **more)), flush=True)


def figure_line(name: str, value: float, unit: str, **more: Any) -> dict[str, Any]:
    """Returns the line of a figure with machine, version and commit."""
    where = {"cpu": machine(), "version": version(), "commit": commit()}
    return {"name": name, "value": value, "unit": unit, **more, **where}


@cache
def commit() -> str | None:
    """Returns the commit of the checkout, with `-dirty` if files differ from it; None outside of Git."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"]
    try:
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def rounded(value: float) -> float | int:
    """Returns the value with four significant digits, the accuracy of a timing; whole numbers stay as they are."""
    return value if isinstance(value, int) else float(f"{value:.4g}")


def timed(call: Callable[[], object], repeats: int) -> list[float]:
    """Returns the wall-clock times [s] of `repeats` calls, shortest first; other work disturbs the shortest least."""
    out = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        out.append(time.perf_counter() - begin)
    return sorted(out)
