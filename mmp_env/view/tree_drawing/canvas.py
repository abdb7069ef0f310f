"""The nodes and edges of a drawing, before title and legend are put around them."""

from __future__ import annotations

from dataclasses import dataclass

from mmp_env.view.tree_drawing.colors import EDGE, WAY
from mmp_env.view.tree_drawing.svg import element, quoted
from mmp_env.view.tree_drawing.telling import everything
from mmp_env.view.tree_record import TreeNode

_ROOMY, _LARGEST = 1300.0, 2.2


@dataclass(frozen=True, kw_only=True)
class Canvas:
    """Edges and nodes as SVG, in a place of `width` x `height` [px]; `style` is that of the legend's samples."""

    edges: list[str]
    nodes: list[str]
    width: float
    height: float
    style: str


def enlarged(width: float) -> float:
    """How many times as large words are in a drawing that wide [px], which is looked at from farther away."""
    return min(max(width / _ROOMY, 1.0), _LARGEST)


def edge(node: TreeNode, x0: float, y0: float, x1: float, y1: float, *, bold: float, thin: float) -> str:
    """From a parent's lower side (x0, y0) to its child (x1, y1); both ends upright, so it leaves siblings alone."""
    middle = (y0 + y1) / 2
    way = f"M{x0:.1f} {y0:.1f}" + (
        f"C{x0:.1f} {middle:.1f} {x1:.1f} {middle:.1f} {x1:.1f} {y1:.1f}" if abs(x1 - x0) > 0.05 else f"V{y1:.1f}"
    )
    return element(
        "path",
        d=way,
        fill="none",
        class_="mmp-way" if node.on_solution_path else "mmp-edge",
        stroke=WAY if node.on_solution_path else EDGE,
        stroke_width=bold if node.on_solution_path else thin,
        stroke_linecap="round",
        data_from=node.parent,
        data_to=node.id,
    )


def group(node: TreeNode, *content: str) -> str:
    """What is drawn of a node, with all that is known of it as its tooltip."""
    return element("g", element("title", quoted(everything(node))), *content, class_="mmp-node", data_node=node.id)


def solution_last(nodes: list[TreeNode]) -> list[TreeNode]:
    """So that the way to the solution lies above other edges."""
    return sorted(nodes, key=lambda node: node.on_solution_path)
