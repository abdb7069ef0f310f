"""Numbers as text for people."""

from __future__ import annotations

import math

from mmp_cli.reporting.statistics import Spread

NOTHING = "–"


def number(value: float | None) -> str:
    """Returns three significant digits, and every digit before the point."""
    if value is None:
        return NOTHING
    if value == 0:
        return "0"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}" if digits < 7 else f"{value:.2e}"


def seconds(value: float | None) -> str:
    """Returns a time in s, ms or µs."""
    if value is None:
        return NOTHING
    for factor, unit in ((1.0, "s"), (1e3, "ms")):
        if value * factor >= 0.9995:
            return f"{number(value * factor)} {unit}"
    return f"{number(value * 1e6)} µs"


def mean_and_std(values: Spread | None) -> str:
    """Returns mean ± sample standard deviation, or the mean of a single value."""
    if values is None:
        return NOTHING
    return f"{number(values.mean)} ± {number(values.std)}" if values.std is not None else number(values.mean)


def share(part: int, whole: int) -> str:
    """Returns `part of whole (percent)`."""
    return f"{part} of {whole} ({100 * part / whole:.0f} %)" if whole else f"{part} of {whole}"
