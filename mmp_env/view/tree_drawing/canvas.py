"""Nodes and edges of a drawing, without title and legend."""

from __future__ import annotations

from dataclasses import dataclass

from mmp_env.view.tree_drawing.colors import EDGE, SOLUTION_PATH
from mmp_env.view.tree_drawing.node_text import node_tooltip
from mmp_env.view.tree_drawing.svg import element, quoted
from mmp_env.view.tree_record import TreeNode

_ROOMY, _LARGEST = 1300.0, 2.2


@dataclass(frozen=True, kw_only=True)
class Canvas:
    """Edges and nodes as SVG, `width` x `height` [px] large; the legend has samples of the same `style`."""

    edges: list[str]
    nodes: list[str]
    width: float
    height: float
    style: str


def enlarged(width: float) -> float:
    """Returns the magnification of text in a drawing of that width [px]: readers see a wide one from farther away."""
    return min(max(width / _ROOMY, 1.0), _LARGEST)


def edge(node: TreeNode, x0: float, y0: float, x1: float, y1: float, *, bold: float, thin: float) -> str:
    """Returns the edge from a parent's lower side (x0, y0) to its child (x1, y1), vertical at both ends."""
    middle = (y0 + y1) / 2
    path = f"M{x0:.1f} {y0:.1f}" + (
        f"C{x0:.1f} {middle:.1f} {x1:.1f} {middle:.1f} {x1:.1f} {y1:.1f}" if abs(x1 - x0) > 0.05 else f"V{y1:.1f}"
    )
    return element(
        "path",
        d=path,
        fill="none",
        class_="mmp-solution" if node.on_solution_path else "mmp-edge",
        stroke=SOLUTION_PATH if node.on_solution_path else EDGE,
        stroke_width=bold if node.on_solution_path else thin,
        stroke_linecap="round",
        data_from=node.parent,
        data_to=node.id,
    )


def group(node: TreeNode, *content: str) -> str:
    """Returns the drawing of a node, with a tooltip."""
    return element("g", element("title", quoted(node_tooltip(node))), *content, class_="mmp-node", data_node=node.id)


def solution_last(nodes: list[TreeNode]) -> list[TreeNode]:
    """Returns the nodes in drawing order: the path to the solution comes last and lies above the others."""
    return sorted(nodes, key=lambda node: node.on_solution_path)
