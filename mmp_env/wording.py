"""Words that go with numbers in messages."""

import math

_MOST_DEGREES = 3600.0


def counted(count: int, noun: str) -> str:
    """`1 node`, `2 nodes`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def degrees_hint(angle: float) -> str:
    """Returns the end of a message about an angle that must be in radians; empty where degrees explain nothing."""
    return f"; {angle:g} looks like degrees" if 2 * math.pi < abs(angle) <= _MOST_DEGREES else ""
