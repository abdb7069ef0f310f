"""Short `__repr__` texts for prompts and notebooks: one line, with units."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

_LONGEST = 300
"""Largest number of characters of a text."""


def brief(text_of: Callable[[Any], str]) -> Callable[[Any], str]:
    """Turns a method that returns a text into a `__repr__`, `<Class text>`.

    The line is short and printable for all names in the value. A malformed value gets Python's own `__repr__`.
    """

    @functools.wraps(text_of)
    def shown(self: Any) -> str:
        try:
            text = text_of(self)
        except Exception:  # a debugger must be able to show malformed values, whatever they raise
            return object.__repr__(self)
        printable = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
        cut = printable if len(printable) <= _LONGEST else printable[:_LONGEST] + "..."
        return f"<{type(self).__name__} {cut}>"

    return shown


def point(position: Float[np.ndarray, "3"]) -> str:
    """Returns a position [m] as text: `[-0.55, 0, 0.1] m`."""
    return f"[{', '.join(f'{x:.4g}' for x in position)}] m"


def some(names: list[str], most: int = 5) -> str:
    """Returns the first names as text: `a, b, c, d, e, ...`."""
    return ", ".join(names[:most]) + (", ..." if len(names) > most else "")
