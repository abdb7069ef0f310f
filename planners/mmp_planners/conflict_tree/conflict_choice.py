"""The conflict that a node is branched on, l. 15, which differs from tree to tree."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

from mmp_planners.conflict_tree.constraints import ConflictInterval
from mmp_planners.conflict_tree.node import Node

Order = Callable[[Node], ConflictInterval]

EARLIEST: tuple[Order, ...] = (Node.first_conflict,)
ALTERNATING: tuple[Order, ...] = (Node.first_conflict, Node.isolated_conflict)
ORDERS = {"alternating": ALTERNATING, "earliest": EARLIEST}
"""Value of the option `conflict_choice` -> the orders of conflicts that take turns from tree to tree."""
PAD_TREES = 8
"""Number of trees after which the reach of constraints begins again."""


@dataclass(frozen=True, kw_only=True)
class ConflictChoice:
    """Chooses a conflict of a node by one of the `orders`, which take turns from tree to tree.

    `pad_growth` is the factor of the reach of `avoid-state` from one tree to the next: with a short reach, two arms
    that block each other only put off their conflict.
    """

    orders: tuple[Order, ...] = ALTERNATING
    pad_growth: float = 1.4

    def __call__(self, node: Node, tree: int) -> ConflictInterval:
        """Returns a conflict of the node; `tree` is the number of restarts before its tree."""
        interval = self.orders[tree % len(self.orders)](node)
        factor = math.prod([self.pad_growth] * (tree % PAD_TREES))  # without `pow`, whose last bit may differ
        return dataclasses.replace(interval, pad_factor=factor)
