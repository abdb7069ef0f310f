"""Which node of the open list is taken next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.bandit import Bandit
from mmp_planners.conflict_tree.node import Node


@runtime_checkable
class Selection(Protocol):
    """Picks a node of OPEN; `lower_bound` is LB, the least bound seen over OPEN so far [rad]."""

    @property
    def w(self) -> float: ...

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node: ...


@dataclass(frozen=True, kw_only=True)
class BestFirst:
    """CBS (Sharon et al. 2015): the cheapest node; of equals the one with the fewest conflicts."""

    @property
    def w(self) -> float:
        return 1.0

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        return min(open_nodes, key=lambda n: (n.cost, n.conflict_count, n.id))


@dataclass(frozen=True, kw_only=True)
class Focal:
    """ECBS (Barer et al. 2014): the fewest conflicts among the nodes that cost no more than w LB.

    Repulsion raises costs above the bounds, so FOCAL can be empty: then the node with the least bound.
    """

    w: float = 1.5

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        focal = [node for node in open_nodes if node.cost <= self.w * lower_bound]
        if not focal:
            return min(open_nodes, key=lambda n: (n.lower_bound, n.id))
        return min(focal, key=lambda n: (n.conflict_count, len(n.conflicts), n.cost, n.id))


class FocalPerKind:
    """Gen-ECBS (Shaoul et al. 2024): a focal list for each constraint kind, and the anchor list; a bandit picks one.

    The anchor list (way 0) has all of OPEN by bound. The list of kind k (way k + 1) has the nodes that cost no more
    than w LB, by conflicts, then those first whose branches are mostly of that kind, then by cost. Of equals the oldest
    is taken. A pending node that is taken counts as a success for its list where replanning it leaves fewer conflicts;
    one that is branched counts for nothing, for its children are not planned yet.
    """

    def __init__(self, *, w: float, bandit: Bandit) -> None:
        self.w, self._bandit = w, bandit
        self._tried: tuple[int, Node, int] | None = None

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        self._learn()
        way = self._bandit.draw()
        node = self._first(way, open_nodes, lower_bound)
        if node.pending:
            self._tried = way, node, node.conflict_count
        return node

    def _first(self, way: int, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        focal = [node for node in open_nodes if node.cost <= self.w * lower_bound] if way else []
        if not focal:
            return min(open_nodes, key=lambda n: n.lower_bound)
        return min(focal, key=lambda n: (n.conflict_count, -n.share(way - 1), n.cost))

    def _learn(self) -> None:
        """A node without a path keeps its parent's conflicts, one that is the solution has none."""
        if self._tried is not None:
            way, node, conflicts = self._tried
            self._bandit.learn(way, node.conflict_count < conflicts)
            self._tried = None
