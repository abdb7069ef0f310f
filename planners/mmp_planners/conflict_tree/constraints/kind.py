"""Constraint kinds: each turns a conflict into the constraints of two or more branches, the children of a node."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_env import core
from mmp_env.model.collision import PLAN_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True)
class ConflictInterval:
    """Two arms `a` < `b` that are in conflict from instant `first` to instant `last` [steps].

    A `lasting` conflict never ends: both arms have reached their goals, which are not free together. The constraints of
    such a conflict have no end, so that an arm takes another candidate. `pad_factor` multiplies the `pad` of
    `avoid-state`.
    """

    a: int
    b: int
    first: float
    last: float
    lasting: bool = False
    pad_factor: float = 1.0

    def other(self, arm: int) -> int:
        """Returns the arm that `arm` is in conflict with."""
        return self.a + self.b - arm

    def end(self, instant: float) -> int:
        """Returns the last step of a constraint that ends one step after the instant, unless the conflict lasts."""
        return core.FOREVER if self.lasting else int(instant) + 1

    def instants(self, where: str) -> list[float]:
        """Returns instants that stand for the interval: its `begin`, its `middle`, or `all` (begin, middle, end).

        The end stands for a lasting conflict.
        """
        if self.lasting:
            return [self.last]
        middle = float(round((self.first + self.last) / 2)) if self.last > self.first else self.first
        return {"begin": [self.first], "middle": [middle], "all": sorted({self.first, middle, self.last})}[where]


INSTANTS = ("begin", "middle", "all")


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """One child of a node: the new constraints of `arm`, their description, and the number of their kind."""

    arm: int
    constraints: tuple[core.Constraint, ...]
    description: str
    kind: int = 0


@runtime_checkable
class ConstraintKind(Protocol):
    """Makes the branches of a conflict.

    `complete`: one of the branches allows each pair of configurations that is free of conflict at the instant. Then
    the branching loses no solution.
    """

    @property
    def complete(self) -> bool: ...

    def branches(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]: ...


@runtime_checkable
class OneSided(Protocol):
    """Makes constraints for one arm of a conflict, for the sake of the other arm. No such kind is complete."""

    def forbid(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, arm: int, instant: str
    ) -> list[core.Constraint]: ...

    def describe(self, context: PlanningContext, interval: ConflictInterval, arm: int) -> str: ...


@dataclass(frozen=True, kw_only=True)
class EitherArm:
    """Makes one branch for each of the two arms, with the same kind of constraint."""

    kind: OneSided

    @property
    def complete(self) -> bool:
        return False

    def branches(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]:
        return tuple(
            Branch(
                arm=arm,
                constraints=tuple(self.kind.forbid(context, paths, interval, arm, instant)),
                description=self.kind.describe(context, interval, arm),
            )
            for arm in (interval.a, interval.b)
        )


@dataclass(frozen=True, kw_only=True)
class EveryKind:
    """Makes the branches of several kinds side by side, numbered by kind. It is complete if one of the kinds is."""

    kinds: tuple[ConstraintKind, ...]

    @property
    def complete(self) -> bool:
        return any(kind.complete for kind in self.kinds)

    def branches(
        self, context: PlanningContext, paths: Sequence[Path], interval: ConflictInterval, instant: str
    ) -> tuple[Branch, ...]:
        return tuple(
            dataclasses.replace(branch, kind=number)
            for number, kind in enumerate(self.kinds)
            for branch in kind.branches(context, paths, interval, instant)
        )


def allows_start(context: PlanningContext, arm: int, constraint: core.Constraint) -> bool:
    """Returns whether the single-arm planner may leave the arm at its start at time 0."""
    start = context.problem.start[context.names[arm]]
    safe = core.safe_intervals(
        context.core, arm, start, [constraint], context.problem.levels(SEARCH_MARGIN_FACTOR, PLAN_MARGIN_FACTOR)
    )
    return len(safe) > 0 and int(safe[0, 0]) == 0


def without_start_violations(
    context: PlanningContext, arm: int, constraints: Sequence[core.Constraint], interval: ConflictInterval
) -> list[core.Constraint]:
    """Drops constraints that end before the conflict begins and that the arm violates at its start at time 0.

    Such a constraint would leave the child without a solution, and what it forbids was no conflict.
    """
    return [c for c in constraints if c.start > 0 or c.end > interval.first or allows_start(context, arm, c)]
