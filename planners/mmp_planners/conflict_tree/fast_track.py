"""The fast track of APF-ECBS: if one arm is in every conflict, repulsion of that arm may resolve all of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.node import Node
from mmp_planners.conflict_tree.repulsion import Modification
from mmp_planners.planning_context import PlanningContext


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """Node M: node N with the path of `arm` modified; `solved` if no conflict is left.

    A solution is a candidate for the plan. If it `replaces` node N, it takes the place of N in OPEN instead.
    """

    node: Node
    arm: int
    replaces: bool = False

    @property
    def solved(self) -> bool:
        return not self.node.conflicts


@runtime_checkable
class FastTrack(Protocol):
    """Makes attempts on a node that is about to be branched."""

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]: ...


@dataclass(frozen=True, kw_only=True)
class NoFastTrack:
    """Makes no attempt: the part of every other planner."""

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]:
        return iter(())


@dataclass(frozen=True, kw_only=True)
class RepulsiveFastTrack:
    """Repels each arm that is in every conflicting pair, in turn, until one attempt leaves no conflict.

    `literal` is the paper-literal setting: a solution replaces the node, so the node cannot be branched any more.
    """

    modification: Modification
    literal: bool = False

    def __call__(self, context: PlanningContext, node: Node) -> Iterator[Attempt]:
        for arm in node.common_arms():
            modified = self.modification(context, node.paths, arm, node.constraints[arm])
            if modified is None:
                continue
            paths, conflicts = node.replaced(context, arm, modified.path)
            modified_node = Node(
                id=node.id,
                parent=node.parent,
                paths=paths,
                constraints=node.constraints,
                bounds=node.bounds,
                conflicts=conflicts,
                fast_tracked=True,
            )
            yield Attempt(arm=arm, node=modified_node, replaces=self.literal)
