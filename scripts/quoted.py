"""Writes figures into running text: `<!-- figure: EXPRESSION as FORMAT -->value<!-- end -->`.

EXPRESSION joins names of figures (NAME, or NAME#KEY for another key of its line) and numbers by ` + `, ` - `, ` * `
and ` / `, from left to right; `max NAME`, `min NAME` and `sum NAME`, NAME a pattern, combine all matches (also with
#KEY). FORMAT is a format of Python such as `.1f`, `time` for a time with a suitable unit, or `of` for "49 of 50".
"""

from __future__ import annotations

import difflib
import fnmatch
import operator
import re
from collections.abc import Callable

from measured import Figures

from mmp_env.errors import MmpError

PLACE = re.compile(r"(<!-- figure: (.+?) as (\S+) -->)(.*?)(<!-- end -->)", re.DOTALL)
_OVER: dict[str, Callable[[list[float]], float]] = {"max": max, "min": min, "sum": sum}


def quoted(page: str, figures: Figures) -> str:
    """Returns the page with each quoted figure as measured. Raises `MmpError` for an unknown name."""
    return PLACE.sub(lambda place: place[1] + shown(place[2], place[3], figures) + place[5], page)


def shown(expression: str, form: str, figures: Figures) -> str:
    """Returns the text of a figure on the page."""
    if form == "of":
        row = _row(expression, figures)
        return f"{row['value']} {row['unit']}"
    value = _value(expression, figures)
    return seconds(value) if form == "time" else format(value, form)


def seconds(value: float) -> str:
    """Returns a time [s] as text with a suitable unit."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if value * factor >= 1:
            scaled = value * factor
            return f"{scaled:.0f} {unit}" if scaled >= 9.95 else f"{scaled:#.2g} {unit}"
    return f"{value * 1e9:.0f} ns"


_SIGNS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}


def _value(expression: str, figures: Figures) -> float:
    first, *rest = re.split(r" ([-+*/]) ", expression)
    out = _term(first, figures)
    for sign, term in zip(rest[::2], rest[1::2], strict=True):
        out = _SIGNS[sign](out, _term(term, figures))
    return out


def _term(text: str, figures: Figures) -> float:
    if re.fullmatch(r"[\d.]+(e-?\d+)?", text):
        return float(text)
    over, _, pattern = text.partition(" ")
    if over in _OVER and pattern:
        pattern, _, key = pattern.partition("#")
        values = [row[key or "value"] for name, row in figures.items() if fnmatch.fnmatchcase(name, pattern)]
        if not values:
            raise MmpError(f"no figure is called like '{pattern}'")
        return _OVER[over](values)
    name, _, key = text.partition("#")
    return _row(name, figures)[key or "value"]


def _row(name: str, figures: Figures) -> dict[str, float]:
    if name not in figures:
        close = difflib.get_close_matches(name, figures, n=1)
        raise MmpError(f"unknown figure '{name}'." + (f" Did you mean '{close[0]}'?" if close else ""))
    return figures[name]
