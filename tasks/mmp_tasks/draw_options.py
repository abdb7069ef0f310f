"""Options that the built-in tasks share, and the loop that repeats a failed draw."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell

T = TypeVar("T")


class DrawFailed(Exception):
    """A draw without a result. This is no error: the next draw begins. The message names where the draw ended."""

    @classmethod
    def at(cls, arm: Arm, why: str = "") -> DrawFailed:
        """Returns the exception of a draw that ended at `arm`."""
        return cls(f"arm '{arm.name}' ({arm.robot.name}){why}")


@dataclass(frozen=True, kw_only=True)
class DrawOptions:
    """The options of a task: clearances of start and goal, and limits for repeated draws.

    Args:
        clearance: least clearance between two arms [m].
        static_clearance: least clearance of an arm from obstacles, other bases and itself [m]. The default leaves room
            for the margin of 2 mm. Neighbouring links of some robots never get 6 mm apart.
        tries: candidates for the configuration of one arm.
        draws: draws before the task gives up. Tasks need ten at most in the built-in cells.

    Raises:
        MmpError: for a clearance that is no length, or a count below 1.
    """

    clearance: float = 0.01
    static_clearance: float = 0.0025
    tries: int = 12
    draws: int = 24

    def __post_init__(self) -> None:
        for option in ("clearance", "static_clearance"):
            value = getattr(self, option)
            if not (math.isfinite(value) and value >= 0):
                raise MmpError(f"{option} of task '{self.name}' is {value}; it must be a length in metres, 0 or more")
        for option in ("tries", "draws"):
            value = getattr(self, option)
            if value < 1:
                raise MmpError(f"{option} of task '{self.name}' is {value}; it must be 1 or more")

    @property
    def name(self) -> str:
        """Registered name of a built-in task: the name of its class in lower case."""
        return type(self).__name__.lower()


def draw_until_success(options: DrawOptions, cell: Cell, draw: Callable[[int], T]) -> T:
    """Returns the result of the first of `draw(0)`, `draw(1)`, ... that does not raise `DrawFailed`.

    Raises:
        MmpError: after `options.draws` failures, with the arm where most of them ended.
    """
    failures = Counter[str]()
    for number in range(options.draws):
        try:
            return draw(number)
        except DrawFailed as failure:
            failures[str(failure)] += 1
    hardest, times = failures.most_common(1)[0]
    raise MmpError(
        f"task '{options.name}' found no instance for cell '{cell.name}' in {options.draws} draws: {times} of them"
        f" ended at {hardest}"
    )
