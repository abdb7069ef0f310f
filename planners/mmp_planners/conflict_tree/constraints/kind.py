"""What a constraint kind is: it turns the conflict that a node is branched on into branches."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_env import _core
from mmp_env.model.collision import PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class ConflictInterval:
    """The conflict that is branched on: arms `a` < `b` touch from `first` to `last`, instants in steps."""

    a: int
    b: int
    first: float
    last: float

    def other(self, arm: int) -> int:
        """The arm that `arm` meets."""
        return self.a + self.b - arm

    def instants(self, where: str) -> list[float]:
        """Instants that stand for the conflict: its `begin`, its `middle`, or `all` of it (begin, middle, end)."""
        middle = float(round((self.first + self.last) / 2)) if self.last > self.first else self.first
        return {"begin": [self.first], "middle": [middle], "all": sorted({self.first, middle, self.last})}[where]


INSTANTS = ("begin", "middle", "all")


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """One child of a node: the constraints that `arm` gets, in words too, and the number of the kind they are of."""

    arm: int
    constraints: tuple[_core.Constraint, ...]
    words: str
    kind: int = 0


@runtime_checkable
class ConstraintKind(Protocol):
    """Makes the branches of a conflict.

    `complete`: whatever two configurations free of conflict the arms have at the instant, one of the branches allows
    them, so that the branching loses no solution.
    """

    @property
    def complete(self) -> bool: ...

    def branches(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]: ...


@runtime_checkable
class OneSided(Protocol):
    """What either arm of a conflict may be forbidden, for the sake of the other one. None of them is complete."""

    def forbid(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, arm: int, instant: str
    ) -> list[_core.Constraint]: ...

    def words(self, arms: PlanningContext, meeting: ConflictInterval, arm: int) -> str: ...


@dataclass(frozen=True, kw_only=True)
class EitherArm:
    """A branch for each of the two arms, the same kind of constraint in both."""

    kind: OneSided

    @property
    def complete(self) -> bool:
        return False

    def branches(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]:
        return tuple(
            Branch(
                arm=arm,
                constraints=tuple(self.kind.forbid(arms, paths, meeting, arm, instant)),
                words=self.kind.words(arms, meeting, arm),
            )
            for arm in (meeting.a, meeting.b)
        )


@dataclass(frozen=True, kw_only=True)
class EveryKind:
    """The branches of several kinds side by side, numbered by kind; complete if one of the kinds is."""

    kinds: tuple[ConstraintKind, ...]

    @property
    def complete(self) -> bool:
        return any(kind.complete for kind in self.kinds)

    def branches(
        self, arms: PlanningContext, paths: Sequence[Path], meeting: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]:
        return tuple(
            dataclasses.replace(branch, kind=number)
            for number, kind in enumerate(self.kinds)
            for branch in kind.branches(arms, paths, meeting, instant)
        )


def may_start(arms: PlanningContext, arm: int, constraint: _core.Constraint) -> bool:
    """Whether the arm may stand at its start at time 0, as the low level sees it."""
    start = arms.problem.start[arms.names[arm]]
    safe = _core.safe_intervals(
        arms.core, arm, start, [constraint], arms.problem.levels(SEARCH_MARGIN_FACTOR, PLAN_MARGIN_FACTOR)
    )
    return len(safe) > 0 and int(safe[0, 0]) == 0


def without_early(
    arms: PlanningContext, arm: int, constraints: Sequence[_core.Constraint], meeting: ConflictInterval
) -> list[_core.Constraint]:
    """Without those that are over when the conflict begins and that the arm's own start breaks at time 0.

    They would leave the child without a solution, and what they forbid was no conflict.
    """
    return [c for c in constraints if c.start > 0 or c.end > meeting.first or may_start(arms, arm, c)]
