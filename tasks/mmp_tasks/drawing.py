"""Drawing: the options that all tasks share, and how often they try."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, TypeVar

from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_tasks.room import Room

T = TypeVar("T")


class DrawFailed(Exception):
    """A draw that came to nothing, which is no error: the next begins. The message says at what it ended."""

    @classmethod
    def at(cls, arm: Arm, why: str = "") -> DrawFailed:
        """A draw that ended at an arm."""
        return cls(f"arm '{arm.name}' ({arm.robot.name}){why}")


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """Clearances to keep [m], between arms and of everything else, and how often to try."""

    called: ClassVar[str]
    """The name that the task is registered under."""
    clearance: float = 0.01
    static_clearance: float = 0.0025
    """Enough that the default margin of 2 mm stays whole. Neighbouring links of some robots can get no 6 mm apart."""
    tries: int = 12
    draws: int = 24
    """In the cells of this package no task needs more than ten; a cell without room is known for one the sooner."""

    def __post_init__(self) -> None:
        for name in ("clearance", "static_clearance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise MmpError(f"{name} of task '{self.called}' is {value}; it must be a length in metres, 0 or more")
        for name in ("tries", "draws"):
            value = getattr(self, name)
            if value < 1:
                raise MmpError(f"{name} of task '{self.called}' is {value}; it must be 1 or more")

    def room(self, cell: Cell) -> Room:
        """The cell with the clearances to keep in it."""
        return Room(cell=cell, clearance=self.clearance, static_clearance=self.static_clearance)

    def first(self, cell: Cell, draw: Callable[[int], T]) -> T:
        """What the first of draws 0, 1, ... gives that is not `DrawFailed`. Raises `MmpError` after `draws` of them."""
        misses = Counter[str]()
        for number in range(self.draws):
            try:
                return draw(number)
            except DrawFailed as miss:
                misses[str(miss)] += 1
        hardest, times = misses.most_common(1)[0]
        raise MmpError(
            f"task '{self.called}' found no instance for cell '{cell.name}' in {self.draws} draws: {times} of them"
            f" ended at {hardest}"
        )
