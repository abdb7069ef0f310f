"""Which node of the open list is taken next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.node import Node


@runtime_checkable
class Selection(Protocol):
    """Picks a node of OPEN; `lower_bound` is LB, the least bound seen over OPEN so far [rad]."""

    @property
    def w(self) -> float: ...

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node: ...


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
