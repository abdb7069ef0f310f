"""Numbers and values in messages."""

import math
import re
import reprlib

LEAST_DEGREES, _MOST_DEGREES = 10.0, 3600.0
"""Bounds of a number that was probably meant in degrees."""
_LONG_S = 1e6
"""Duration [s] from which a few digits suffice."""


def in_seconds(duration_s: float, decimals: int = 2) -> str:
    """Returns a duration as text, `2.35 s`; an absurd one has few digits, `1e+300 s`."""
    digits = f".{decimals}f" if abs(duration_s) < _LONG_S else ".6g"
    return f"{duration_s:{digits}} s"


def counted(count: int, noun: str) -> str:
    """Returns `1 node`, `2 nodes`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def degrees_hint(angle: float) -> str:
    """Returns the end of a message about an angle in radians: a hint if it looks like degrees, otherwise nothing."""
    return f"; {angle:g} looks like degrees" if LEAST_DEGREES <= abs(angle) <= _MOST_DEGREES else ""


def how_far_apart(clearance_m: float) -> str:
    """Returns words for the clearance [m] of two bodies, such as `2.0 mm apart`, `touching` or `1.5 mm deep`."""
    shown_mm = f"{abs(clearance_m) * 1e3:.1f}"
    return "touching" if shown_mm == "0.0" else f"{shown_mm} mm {'deep' if clearance_m < 0 else 'apart'}"


def markdown_escaped(text: str) -> str:
    """Returns text on one line in which no character has a meaning in Markdown or HTML."""
    line = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    line = re.sub(r"([\\`*\[\]|~$#@]|:(?=//)|(?<=www)[.])", r"\\\1", line, flags=re.IGNORECASE)
    # An underscore inside a word is text as it is; at its edge it would begin emphasis.
    return re.sub(r"(?<!\w)_|_(?!\w)", r"\\_", line)


class _Short(reprlib.Repr):
    def repr_int(self, x: int, level: int) -> str:
        # Python refuses to write out a number of more than 4300 digits.
        return super().repr_int(x, level) if abs(x) < 10**self.maxlong else f"a number of {_digits(x)} digits"


_SHORT = _Short()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 60
_SHORT.maxlist, _SHORT.maxdict, _SHORT.maxlevel = 7, 3, 2


def shown(value: object) -> str:
    """Returns a value on one short line."""
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else _SHORT.repr(value)


def _digits(number: int) -> int:
    """Returns about how many digits a whole number has."""
    return int(number.bit_length() * math.log10(2)) + 1
