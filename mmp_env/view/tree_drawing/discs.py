"""Drawing of many nodes: coloured discs, with the number of conflicts where it is legible."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mmp_env.view.tree_drawing.canvas import Canvas, edge, enlarged, group, solution_last
from mmp_env.view.tree_drawing.colors import FAINT, INK, SOLUTION_PATH, conflict_color, text_color
from mmp_env.view.tree_drawing.svg import element, text_width, words
from mmp_env.view.tree_layout import layout
from mmp_env.view.tree_record import TreeNode, TreeRecord

_NUMBER, _CAPTION, _RIM = 12.0, 12.0, 1.8
_BORDER = 30.0
"""Room [px] for a caption over a tree of one node."""


@dataclass(frozen=True, kw_only=True)
class DiscStyle:
    """Sizes [px]: radius of expanded and of other nodes, column, row, and width of edges to the solution."""

    name: str
    expanded: float
    generated: float
    column: float
    row: float
    solution_width: float
    numbers: bool


NUMBERED = DiscStyle(
    name="numbered", expanded=14.0, generated=14.0, column=35.0, row=54.0, solution_width=4.0, numbers=True
)
DOTS = DiscStyle(name="dots", expanded=5.2, generated=3.6, column=15.0, row=30.0, solution_width=3.0, numbers=False)


def draw_discs(tree: TreeRecord, discs: DiscStyle, width: float | None, most: int | None = None) -> Canvas:
    """Returns a canvas of discs; the trees of a forest stand in rows of at most `width` columns.

    `most` is the number of conflicts with the darkest colour, by default the largest in the tree.
    """
    places = layout(tree.parents, width=width)
    forest = len(tree.roots) > 1
    large = enlarged(places[:, 0].max() * discs.column + 2 * _BORDER) if forest else 1.0
    border = max(discs.expanded + 6, large * _BORDER)
    across = border + places[:, 0] * discs.column
    # Large captions need more room above each row of trees.
    rows = np.searchsorted(np.unique(places[[root.id for root in tree.roots], 1]), places[:, 1], side="right")
    down = border + places[:, 1] * discs.row + (rows - 1) * (large - 1.0) * _CAPTION
    if most is None:
        most = max((node.conflicts or 0 for node in tree.nodes), default=0)
    edges, nodes = [], []
    for node in solution_last(tree.nodes):
        x, y = float(across[node.id]), float(down[node.id])
        if node.parent is not None:
            x0, y0 = float(across[node.parent]), float(down[node.parent])
            edges.append(edge(node, x0, y0, x, y, bold=discs.solution_width, thin=1.1))
        nodes.append(disc(node, discs, x, y, most))
    if forest:
        tops = [(float(across[root.id]), float(down[root.id]) - discs.expanded - 7) for root in tree.roots]
        edges += _captions(tops, large * _CAPTION)
    width, height = (float(places.max()) + border for places in (across, down))
    return Canvas(edges=edges, nodes=nodes, width=width, height=height, style=discs.name)


def disc(node: TreeNode, discs: DiscStyle, x: float, y: float, most: int) -> str:
    """Returns a node: a circle, or a diamond for the fast track. The solution has a ring."""
    color = conflict_color(node.conflicts, most)
    radius = discs.expanded if node.expanded or node.on_solution_path else discs.generated
    is_solution = node.on_solution_path
    line = {"class_": "mmp-solution", "stroke": SOLUTION_PATH} if is_solution else {"class_": "mmp-line", "stroke": INK}
    dashed = "3 2.2" if discs.numbers and not (node.expanded or node.conflicts == 0) else None
    thick = (2.6 if discs.numbers else 2.0) if is_solution else (1.2 if node.expanded or discs.numbers else 0.6)
    look = {"fill": color, "stroke_width": thick, "stroke_dasharray": dashed, **line}
    out = [diamond(x, y, radius, **look) if node.fast_track else element("circle", cx=x, cy=y, r=radius, **look)]
    if discs.numbers and node.conflicts is not None:
        text = str(node.conflicts)
        size = min(_NUMBER, 2 * (radius - _RIM) / max(text_width(text, 1.0), 1e-9))
        ink: dict[str, Any] = {"fill": text_color(color), "class_": "mmp-head", "text_anchor": "middle"}
        out.append(words(text, x, y + 0.36 * size, size=size, **ink))
    return group(node, *out)


def diamond(x: float, y: float, radius: float, **look: object) -> str:
    """Returns a square on its corner, as high as a circle of 1.2 times the radius."""
    half = 1.2 * radius
    points = " ".join(f"{x + a * half:.1f},{y + b * half:.1f}" for a, b in ((0, -1), (1, 0), (0, 1), (-1, 0)))
    return element("polygon", points=points, **look)


def _captions(tops: list[tuple[float, float]], size: float) -> Iterator[str]:
    """Yields the numbers of the trees above their roots, where they do not overlap."""
    faint: dict[str, Any] = {"class_": "mmp-faint", "fill": FAINT, "text_anchor": "middle"}
    end, row = -math.inf, -math.inf
    for number, (x, y) in enumerate(tops, 1):
        if y > row:
            end, row = -math.inf, y
        for text in (f"tree {number}", str(number)):
            half = text_width(text, size) / 2
            if x - half > end + 4:
                yield words(text, x, y, size=size, **faint)
                end = x + half
                break
