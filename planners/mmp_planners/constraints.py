"""Constraint kinds: what a branch of the conflict tree forbids an arm (ALGORITHMS: none of these two is complete).

A kind turns one side of a conflict into constraints: arm `arm` must keep away from what arm `other` does in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_env import _core
from mmp_planners.arms import Arms, Path


@dataclass(frozen=True, kw_only=True)
class Meeting:
    """The conflict that is branched on: arms `a` < `b` touch from `first` to `last`, instants in steps."""

    a: int
    b: int
    first: float
    last: float

    def instants(self, where: str) -> list[float]:
        """Instants that stand for the conflict: its `begin`, its `middle`, or `all` of it (begin, middle, end)."""
        middle = float(round((self.first + self.last) / 2)) if self.last > self.first else self.first
        return {"begin": [self.first], "middle": [middle], "all": sorted({self.first, middle, self.last})}[where]


INSTANTS = ("begin", "middle", "all")


@runtime_checkable
class ConstraintKind(Protocol):
    """Makes the constraints of one child."""

    def forbid(
        self, arms: Arms, paths: Sequence[Path], meeting: Meeting, arm: int, instant: str
    ) -> list[_core.Constraint]: ...

    def words(self, arms: Arms, meeting: Meeting, arm: int) -> str: ...


@dataclass(frozen=True, kw_only=True)
class AvoidState:
    """Do not touch the other arm as it stands at the conflict, from `pad` [s] before it begins to `pad` after it ends.

    The constraint of CBS-MP (Solis et al. 2021). Where the other arm is at its goal already it stays there, and so does
    the constraint. Where the arm's own start touches that state the window opens with the conflict, not before: else a
    conflict in the first moments would leave both children without a solution.
    Not complete: the other arm need not stand there in every solution.
    """

    pad: float = 0.25

    def forbid(
        self, arms: Arms, paths: Sequence[Path], meeting: Meeting, arm: int, instant: str
    ) -> list[_core.Constraint]:
        other = meeting.a + meeting.b - arm
        pad = round(self.pad / arms.dt)
        out = []
        for k in meeting.instants(instant):
            q = paths[other].at(k)
            first, last = int(meeting.first), math.ceil(meeting.last)
            start = first if arms.start_touches(arm, other, q) else max(0, first - pad)
            end = _core.FOREVER if k >= paths[other].last else last + 1 + pad
            out.append(_core.Constraint.standing(arms.core, other, q, 0.0, start, end))
        return out

    def words(self, arms: Arms, meeting: Meeting, arm: int) -> str:
        other = arms.names[meeting.a + meeting.b - arm]
        return f"{arms.names[arm]} avoids {other} at {meeting.first * arms.dt:.1f} s"


@dataclass(frozen=True, kw_only=True)
class Vertex:
    """Keep out of a ball about the own configuration at the conflict: the paper's constraint, with a stated radius.

    max_j |q_j - q_c,j| <= r_c while |t - t_k| <= tau, with r_c = min(`radius` [rad], v_max t_k / 2) and tau = dt. A
    point in a continuous space has measure zero, hence the radius; it shrinks near the start so that a child stays
    solvable.
    """

    radius: float = 0.2

    def forbid(
        self, arms: Arms, paths: Sequence[Path], meeting: Meeting, arm: int, instant: str
    ) -> list[_core.Constraint]:
        out = []
        for k in meeting.instants(instant):
            radius = min(self.radius, float(arms.max_step[arm].max()) * k / 2)
            out.append(_core.Constraint.ball(paths[arm].at(k), radius, max(0, math.ceil(k) - 1), int(k) + 1))
        return out

    def words(self, arms: Arms, meeting: Meeting, arm: int) -> str:
        return f"{arms.names[arm]} leaves its place at {meeting.first * arms.dt:.1f} s"
