"""The fast track of APF-ECBS: one arm in every conflict, all of them resolved at once by moving that arm away."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.repulsion import Modification
from mmp_planners.planning_context import PlanningContext


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """Node M: N with the path of `arm` modified; `solved` if no conflict is left."""

    node: Node
    arm: int

    @property
    def solved(self) -> bool:
        return not self.node.conflicts


@runtime_checkable
class FastTrack(Protocol):
    """Tries on a node that is about to be branched."""

    def __call__(self, arms: PlanningContext, node: Node) -> Iterator[Attempt]: ...


@dataclass(frozen=True, kw_only=True)
class NoFastTrack:
    """Every other planner: no try."""

    def __call__(self, arms: PlanningContext, node: Node) -> Iterator[Attempt]:
        return iter(())


@dataclass(frozen=True, kw_only=True)
class RepulsiveFastTrack:
    """The arms in every conflicting pair, in turn, until one try leaves no conflict.

    `literal` (the paper): the first common arm alone, and the node itself takes the modified path whatever is left.
    """

    modification: Modification
    literal: bool = False

    def __call__(self, arms: PlanningContext, node: Node) -> Iterator[Attempt]:
        for arm in node.common_arms()[: 1 if self.literal else None]:
            modified = self.modification(arms, node.paths, arm, node.constraints[arm])
            if modified is None:
                continue
            paths, conflicts = node.replaced(arms, arm, modified.path)
            attempt = Attempt(
                arm=arm,
                node=Node(
                    id=node.id,
                    parent=node.parent,
                    paths=paths,
                    constraints=node.constraints,
                    bounds=node.bounds,
                    conflicts=conflicts,
                    fast_tracked=True,
                ),
            )
            if self.literal:
                node.update(paths=paths, conflicts=conflicts)
            yield attempt
