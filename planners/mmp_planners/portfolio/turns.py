"""Turns of the members of a portfolio. Each gets a share of the work, and less of it while it achieves little.

Work is counted and not timed, so that the same seed gives the same plan. Its unit takes about a microsecond.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

FAILED = 0.5
"""Share of a member after a failed attempt, relative to that before it."""


class Turn(NamedTuple):
    """The work of a member in one turn.

    Attributes:
        work: its work.
        failed: whether an attempt ended without a plan.
    """

    work: float
    failed: bool = False


@dataclass(kw_only=True)
class Member:
    """A member of a portfolio.

    Attributes:
        name: name of the planner.
        turns: does one turn after the other, until the member has a plan or gives up.
        share: share of the work, relative to the other members.
        waited: the work of a member with a share of 1 after which it is this member's turn.
    """

    name: str
    turns: Iterator[Turn]
    share: float = 1.0
    waited: float = 0.0

    def count(self, turn: Turn) -> None:
        """Counts a turn."""
        self.waited += turn.work / self.share
        if turn.failed:
            self.share *= FAILED
