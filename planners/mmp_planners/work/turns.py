"""Which arms may begin a motion: each in its own time, or all in rounds, as in cells that plan one motion at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from mmp_env.work.jobs import Line, Move
from mmp_planners.work.dispatch import Option
from mmp_planners.work.timeline import Timeline


@runtime_checkable
class Turns(Protocol):
    """Decides which arms may go on."""

    def admitted(self, options: Sequence[Option]) -> list[Option]:
        """Returns the options that may be taken now, in their order."""
        ...

    def taken(self, option: Option) -> None:
        """Notes that an arm takes the step of an option."""
        ...

    def next_round(self) -> bool:
        """Begins a new round, if an arm has moved in this one. Returns whether it did."""
        ...


class OwnTime:
    """Every arm goes on as soon as it can."""

    def admitted(self, options: Sequence[Option]) -> list[Option]:
        """See `Turns`."""
        return list(options)

    def taken(self, option: Option) -> None:
        """See `Turns`."""

    def next_round(self) -> bool:
        """See `Turns`."""
        return False


class Rounds:
    """In a round every arm moves once. The next round begins when all arms have arrived.

    After its motion an arm still grasps, releases or waits in the same round.

    Args:
        timeline: the committed motions.

    Attributes:
        begins: periods at which rounds begin.
    """

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self._moved: set[int] = set()
        self.begins = [0]

    def admitted(self, options: Sequence[Option]) -> list[Option]:
        """See `Turns`."""
        return [option for option in options if option.arm not in self._moved or not _moves(option)]

    def taken(self, option: Option) -> None:
        """See `Turns`."""
        if _moves(option):
            self._moved.add(option.arm)

    def next_round(self) -> bool:
        """See `Turns`."""
        if not self._moved:
            return False
        self._moved.clear()
        self.begins.append(self._timeline.last())
        for arm in range(len(self._timeline.names)):
            self._timeline.wait(arm, self.begins[-1])
        return True


def _moves(option: Option) -> bool:
    return isinstance(option.state.next_step, Move | Line)
