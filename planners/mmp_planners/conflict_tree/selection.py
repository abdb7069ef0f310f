"""Selects the next node of the open list."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mmp_planners.conflict_tree.bandit import Bandit
from mmp_planners.conflict_tree.node import Node


@runtime_checkable
class Selection(Protocol):
    """Selects a node of OPEN. `lower_bound` is LB [rad], the least bound of all leaves."""

    @property
    def w(self) -> float: ...

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node: ...


@dataclass(frozen=True, kw_only=True)
class BestFirst:
    """Selects the cheapest node, and among equals the one with the fewest conflicts (CBS, Sharon et al. 2015)."""

    @property
    def w(self) -> float:
        return 1.0

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        return min(open_nodes, key=lambda n: (n.cost, n.conflict_count, n.id))


@dataclass(frozen=True, kw_only=True)
class Focal:
    """Selects the fewest conflicts among the nodes that cost at most w LB (ECBS, Barer et al. 2014).

    Repulsion raises costs above the bounds, so FOCAL can be empty. Then the node with the least bound is selected.
    """

    w: float = 1.5

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        focal = [node for node in open_nodes if node.cost <= self.w * lower_bound]
        if not focal:
            return min(open_nodes, key=lambda n: (n.lower_bound, n.id))
        return min(focal, key=lambda n: (n.conflict_count, len(n.conflicts), n.cost, n.id))


class FocalPerKind:
    """Keeps one focal list per constraint kind and an anchor list; a bandit picks the list (Gen-ECBS, Shaoul et al.
    2024).

    List 0, the anchor, orders all of OPEN by bound. List k + 1, of kind k, holds the nodes that cost at most w LB. It
    orders them by conflicts, then by their share of branches of that kind, then by cost; the oldest comes first among
    equals. A pending node counts as a success of its list if replanning leaves fewer conflicts. A branched node counts
    for nothing, because its children are not planned yet.
    """

    def __init__(self, *, w: float, bandit: Bandit) -> None:
        self.w, self._bandit = w, bandit
        self._tried: tuple[int, Node, int] | None = None

    def __call__(self, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        self._learn()
        choice = self._bandit.draw()
        node = self._first(choice, open_nodes, lower_bound)
        if node.pending:
            self._tried = choice, node, node.conflict_count
        return node

    def _first(self, choice: int, open_nodes: Sequence[Node], lower_bound: float) -> Node:
        focal = [node for node in open_nodes if node.cost <= self.w * lower_bound] if choice else []
        if not focal:
            return min(open_nodes, key=lambda n: n.lower_bound)
        return min(focal, key=lambda n: (n.conflict_count, -n.share(choice - 1), n.cost))

    def _learn(self) -> None:
        """Tells the bandit the outcome: a node without a path keeps its parent's conflicts, a solution has none."""
        if self._tried is not None:
            choice, node, conflicts = self._tried
            self._bandit.learn(choice, node.conflict_count < conflicts)
            self._tried = None
