"""Margins: the clearances [m] that a plan keeps between arms, to obstacles, and between the parts of one arm."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from mmp_env.argument_checks import given, number, refused
from mmp_env.errors import UnknownNameError
from mmp_env.model.arm import LARGEST_M

LEAST_MARGIN_M = 1e-12
"""Lower bound of margins [m]. Below is the rounding of clearances in double precision."""
DEFAULT_MARGIN_M = 0.002
"""Margin [m] where none is asked for; smaller where start or goal is tighter."""
KINDS = ("arms", "obstacles", "self")
"""Kinds of margin: between two arms, between an arm and an obstacle, between two parts of one arm."""
KIND_WORDS = {"arms": "between arms", "obstacles": "to obstacles", "self": "between parts of one arm"}
"""Kind of margin -> words for messages."""
TIGHT_FACTOR = 0.8
"""Largest default margin, relative to the clearance of start and goal; the rest is room to plan in."""
SLACK_FACTOR = 0.5
"""Slack of the planners, relative to the smallest margin."""
LEAST_SLACK_M, MOST_SLACK_M = 1e-4, 1e-3
"""Bounds of the slack [m], if start and goal leave that much room."""
_ALLOWED = f"a finite number of metres above 0, {LEAST_MARGIN_M:g} at least and {LARGEST_M:g} at most"
_END_FACTOR = 0.9
"""Largest slack, relative to the room between the margin and the clearance of start and goal."""
_LONGEST_M = 1e9
"""Largest length [m] that messages round down; hundredths of a millimetre are exact up to it."""
_LEAST_ROOM_M = 2e-5 / _END_FACTOR
"""Least room [m] between a margin and start and goal; the single-precision kernels are off by up to 1e-5 m."""


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Clearances [m]: `arms` between two arms, `obstacles` between an arm and an obstacle, `self` between two parts
    of one arm.

    Margins are also readable as a mapping: `margins["arms"]`, `dict(margins)`.
    """

    arms: float
    obstacles: float
    self: float

    def keys(self) -> tuple[str, ...]:
        """Returns the three names in the order of the fields."""
        return KINDS

    def __getitem__(self, kind: str) -> float:
        if kind not in KINDS:
            raise KeyError(kind)
        return getattr(self, kind)

    def __iter__(self) -> Iterator[str]:
        return iter(KINDS)

    def __str__(self) -> str:
        """Returns `2 mm`, or each margin if they differ."""
        if len({f"{self[kind]:.6f}" for kind in KINDS}) == 1:
            return f"{millimetres(self.arms)} mm"
        return ", ".join(f"{millimetres(self[kind])} mm {KIND_WORDS[kind]}" for kind in KINDS)


NO_MARGINS = Margins(arms=0.0, obstacles=0.0, self=0.0)
"""Margins [m] for queries that look for contacts alone."""


def asked_margins(margin: float | Mapping[str, Any] | Margins | None) -> dict[str, float]:
    """Returns the margins that were asked for, by kind; a missing kind was not asked for.

    Args:
        margin: metres between arms and to obstacles; or a mapping with any of `arms`, `obstacles`, `self`; or None.
            A kind that is None was not asked for either.

    Raises:
        MmpError: for an unknown kind, or a margin that is not a number from 1e-12 to 100 m.
    """
    if margin is None:
        return {}
    asked: Mapping[str, Any] = (
        dict(margin) if isinstance(margin, Mapping | Margins) else {"arms": margin, "obstacles": margin}
    )
    out: dict[str, float] = {}
    for kind, value in asked.items():
        if kind not in KINDS:
            raise UnknownNameError("margin", str(kind), KINDS)
        if value is not None:
            out[kind] = _asked(f"margin {KIND_WORDS[kind]}", value, _ALLOWED)
    return {kind: out[kind] for kind in KINDS if kind in out}


def check_margins(margins: object) -> None:
    """Raises `MmpError` unless these are `Margins`, and each of them is a number from 1e-12 to 100 m."""
    each = given("margins", margins, Margins, "Margins(arms=..., obstacles=..., self=...), each in metres")
    for kind in KINDS:
        _asked(f"margin {KIND_WORDS[kind]}", each[kind], _ALLOWED)


def queried_margins(margin: object) -> Margins:
    """Returns the margins [m] of a collision query: one number for all kinds, or `Margins`.

    Raises `MmpError` unless each of them is 0, or a number from `LEAST_MARGIN_M` to 100 m.
    """
    if isinstance(margin, Margins):
        by_name = {kind: (f"margin {KIND_WORDS[kind]}", margin[kind]) for kind in KINDS}
    else:
        by_name = dict.fromkeys(KINDS, ("margin", margin))
    allowed = f"0, or {_ALLOWED}"
    return Margins(**{kind: _asked(name, value, allowed, zero=True) for kind, (name, value) in by_name.items()})


def _asked(name: str, value: object, allowed: str, *, zero: bool = False) -> float:
    """Returns a margin [m] from `LEAST_MARGIN_M` to `LARGEST_M`, or 0 if `zero` allows it. Raises `MmpError`."""
    out = number(name, value, allowed, zero=zero)
    if out and not LEAST_MARGIN_M <= out <= LARGEST_M:
        raise refused(name, value, allowed)
    return out


def margin_in_force(kind: str, asked: Mapping[str, float], clearance: float) -> float:
    """Returns the margin [m] of one kind: the one asked for, or the default, which adapts to a tight start or goal.

    Args:
        clearance: the least clearance [m] of that kind in start and goal.
    """
    return asked[kind] if kind in asked else min(DEFAULT_MARGIN_M, TIGHT_FACTOR * clearance)


def largest_margin(clearance: float) -> float:
    """Returns the largest margin [m] that a plan can keep if start or goal has this `clearance` [m]."""
    return clearance - _LEAST_ROOM_M


def planning_slack(margins: Margins, clearances: Mapping[str, float], room: float = math.inf) -> float:
    """Returns the slack [m] that planners add to the margins, so that a later proof of the margins ends.

    Args:
        clearances: kind -> the least clearance [m] of start and goal.
        room: the least room [rad] of start and goal in the bounds of tool axes.
    """
    wanted = min(max(SLACK_FACTOR * min(margins[kind] for kind in KINDS), LEAST_SLACK_M), MOST_SLACK_M)
    return min([wanted, _END_FACTOR * room, *(_END_FACTOR * (clearances[kind] - margins[kind]) for kind in KINDS)])


def millimetres(metres: float) -> str:
    """Returns a length in millimetres, rounded down, so that no margin looks larger than it is."""
    if 0 < metres < LEAST_MARGIN_M:  # the power of ten may be beyond all floats
        return "0"
    if not 0 < metres <= _LONGEST_M:
        return f"{metres * 1e3:g}"
    digits = 2 if metres >= 1e-5 else 2 - math.floor(math.log10(metres * 1e3))
    return f"{math.floor(metres * 1e3 * 10**digits + 1e-6) / 10**digits:g}"
