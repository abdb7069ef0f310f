"""Layout of a tree: parents are centred over their children, and subtrees are as close as possible.

The aesthetics of E. Reingold and J. Tilford, "Tidier Drawings of Trees" (1981), with contours that are merged at the
cost of the lower of two subtrees: linear time, and no recursion, so a chain of ten thousand nodes is drawn too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError

BETWEEN_TREES = 2.0
"""Distance between the nearest columns of two trees of a forest; neighbours within a tree have distance 1."""


def layout(parents: Sequence[int | None], *, width: float | None = None) -> Float[np.ndarray, "n 2"]:
    """Returns the positions [n, 2] of the nodes: x across, and y, the depth in whole numbers. Both begin at 0.

    `parents` has the index of each node's parent, None for a root. Children stand in the order of their indices, no two
    nodes of a level closer than 1. The trees of a forest stand side by side; with `width`, in rows that are no wider if
    a tree alone is not, and y then counts on from row to row. Raises `MmpError` for a parent that is no node, and where
    nodes are their own ancestors.
    """
    order, children = _from_the_roots(parents)
    out = np.zeros((len(parents), 2))
    trees: list[_Contour] = []
    relative = _subtrees(order, children, trees)
    tree = np.zeros(len(parents), dtype=int)
    count = 0
    for node in order:
        parent = parents[node]
        if parent is None:
            tree[node], count = count, count + 1
        else:
            tree[node] = tree[parent]
            out[node] = out[parent] + (relative[node], 1.0)
    if count:
        out += _corners(trees, width)[tree]
    return out


@dataclass
class _Contour:
    """The outermost nodes of a subtree at each level, the lowest first, so that a root is appended at the end.

    x is the number in the list plus a common shift, so moving a subtree takes constant time.
    """

    left: list[float]
    right: list[float]
    left_shift: float = 0.0
    right_shift: float = 0.0

    @property
    def extent(self) -> tuple[float, float]:
        return min(self.left) + self.left_shift, max(self.right) + self.right_shift

    def move(self, distance: float) -> None:
        self.left_shift += distance
        self.right_shift += distance

    def put_on(self, x: float) -> None:
        self.left.append(x - self.left_shift)
        self.right.append(x - self.right_shift)

    def take_in(self, other: _Contour) -> float:
        """Puts another subtree to the right of this one, as close as possible, and returns how far it was moved."""
        common = min(len(self.left), len(other.left))
        ours, theirs = self.right[-common:], other.left[-common:]
        apart = max(a - b for a, b in zip(ours, theirs, strict=True)) + self.right_shift - other.left_shift + 1.0
        other.move(apart)
        if len(other.left) > len(self.left):
            shift = self.left_shift - other.left_shift
            other.left[-common:] = [x + shift for x in self.left]
            self.left, self.left_shift = other.left, other.left_shift
            self.right, self.right_shift = other.right, other.right_shift
        else:
            shift = other.right_shift - self.right_shift
            self.right[-common:] = [x + shift for x in other.right]
        return apart


def _from_the_roots(parents: Sequence[int | None]) -> tuple[list[int], list[list[int]]]:
    """Returns the nodes, parents before their children, and the children of each."""
    children: list[list[int]] = [[] for _ in parents]
    order = [node for node, parent in enumerate(parents) if parent is None]
    for node, parent in enumerate(parents):
        if parent is not None:
            if not 0 <= parent < len(parents):
                raise MmpError(f"node {node} has the parent {parent}; there are nodes 0 to {len(parents) - 1}")
            children[parent].append(node)
    for node in order:  # the list grows during the loop
        order.extend(children[node])
    if len(order) < len(parents):
        lost = min(set(range(len(parents))) - set(order))
        raise MmpError(f"node {lost} hangs from no root: its parents go round in a circle")
    return order, children


def _subtrees(order: Sequence[int], children: Sequence[Sequence[int]], trees: list[_Contour]) -> Float[np.ndarray, "n"]:
    """Returns the x of each node relative to its parent, and appends the contours of the roots to `trees`."""
    relative = np.zeros(len(order))
    contours: dict[int, _Contour] = {}
    below = {child for family in children for child in family}
    for node in reversed(order):
        family = children[node]
        if not family:
            contours[node] = _Contour([0.0], [0.0])
            continue
        contour = contours.pop(family[0])
        places = [0.0, *(contour.take_in(contours.pop(child)) for child in family[1:])]
        middle = (places[0] + places[-1]) / 2
        relative[list(family)] = np.array(places) - middle
        contour.move(-middle)
        contour.put_on(0.0)
        contours[node] = contour
    trees.extend(contours[node] for node in order if node not in below)
    return relative


def _corners(trees: Sequence[_Contour], width: float | None) -> Float[np.ndarray, "t 2"]:
    """Returns the positions of the roots."""
    return np.array(list(_rows(trees, np.inf if width is None else width)))


def _rows(trees: Sequence[_Contour], width: float) -> Iterator[tuple[float, float]]:
    x, y, deepest = 0.0, 0.0, 0
    for contour in trees:
        low, high = contour.extent
        if x > 0 and x + high - low > width:
            x, y, deepest = 0.0, y + deepest, 0
        yield x - low, y
        x += high - low + BETWEEN_TREES
        deepest = max(deepest, len(contour.left))
