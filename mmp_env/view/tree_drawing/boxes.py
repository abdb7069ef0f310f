"""Drawing of few nodes: boxes with conflicts and cost, and above each the difference from its parent."""

from __future__ import annotations

from typing import Any

from mmp_env.view.tree_drawing.canvas import Canvas, edge, group, solution_last
from mmp_env.view.tree_drawing.colors import BODY, BOLT, FAINT, INK, SOLUTION_PATH, conflict_color, text_color
from mmp_env.view.tree_drawing.node_text import branch_text, conflicts_text, cost_text
from mmp_env.view.tree_drawing.svg import element, text_width, words, wrapped
from mmp_env.view.tree_layout import layout
from mmp_env.view.tree_record import TreeNode, TreeRecord

_HEAD, _SIZE, _SMALL = 21.0, 12.0, 11.0
_LINE = 14.0
_BODY = 40.0
_PADDING, _GAP = 10.0, 18.0
_CURVE, _STEM = 34.0, 12.0
_LABEL_WIDTH, _LABEL_LINES = 122.0, 3


def draw_boxes(tree: TreeRecord) -> Canvas:
    """Returns a canvas of boxes."""
    boxes = _Boxes(tree)
    places = layout(tree.parents)
    across = [boxes.column / 2 + x * boxes.column for x in places[:, 0]]
    top = boxes.above if len(tree.roots) > 1 else 6.0
    down = [top + y * boxes.row for y in places[:, 1]]
    edges, nodes = [], []
    for node in solution_last(tree.nodes):
        x, y = float(across[node.id]), float(down[node.id])
        if node.parent is not None:
            x0, y0 = float(across[node.parent]), float(down[node.parent]) + boxes.height
            edges.append(boxes.edge(node, x0, y0, x, y))
        nodes.append(boxes.node(node, x, y))
    height = max(down) + boxes.height + 4
    return Canvas(edges=edges, nodes=nodes, width=max(across) + boxes.column / 2, height=height, style="boxes")


class _Boxes:
    """The size of all boxes; `above` is the room for text over a box."""

    def __init__(self, tree: TreeRecord) -> None:
        heads = (text_width(conflicts_text(node), _SIZE, bold=True) for node in tree.nodes)
        costs = (text_width(cost_text(node), _SIZE) for node in tree.nodes)
        feet = (text_width(_foot(node), _SMALL) for node in tree.nodes)
        self.width = max(96.0, *heads, *costs, *feet) + 2 * _PADDING
        self.column = max(self.width, _LABEL_WIDTH) + _GAP
        self.height = _HEAD + _BODY
        several = len(tree.roots) > 1
        titles = {root.id: f"tree {k}" if several else "" for k, root in enumerate(tree.roots, 1)}
        room = self.column - _GAP
        self.labels = [
            wrapped(titles.get(node.id) or branch_text(node), _SMALL, room, _LABEL_LINES) for node in tree.nodes
        ]
        self.above = _STEM + _LINE * max(map(len, self.labels))
        self.row = self.height + _CURVE + self.above
        self.most = max((node.conflicts or 0 for node in tree.nodes), default=0)

    def edge(self, node: TreeNode, x0: float, y0: float, x: float, y: float) -> str:
        """Returns the edge down to the text above a box, and on from there."""
        lines = self.labels[node.id]
        if not lines:
            return edge(node, x0, y0, x, y, bold=3.2, thin=1.3)
        top = y - _STEM - _LINE * len(lines)
        return edge(node, x0, y0, x, top, bold=3.2, thin=1.3) + edge(node, x, y - _STEM + 4, x, y, bold=3.2, thin=1.3)

    def node(self, node: TreeNode, x: float, y: float) -> str:
        """Returns the box and the text above it."""
        left, color = x - self.width / 2, conflict_color(node.conflicts, self.most)
        lines = self.labels[node.id]
        is_solution = node.on_solution_path
        out = [
            words(
                line,
                x,
                y - _STEM - 4 - _LINE * (len(lines) - 1 - k),
                size=_SMALL,
                text_anchor="middle",
                class_="mmp-solution-text" if is_solution else "mmp-word",
                fill=SOLUTION_PATH if is_solution else FAINT,
            )
            for k, line in enumerate(lines)
        ]
        out += self._frame(node, left, y, color)
        middle: dict[str, Any] = {"text_anchor": "middle"}
        head: dict[str, Any] = {"fill": text_color(color), "class_": "mmp-head"}
        out.append(words(conflicts_text(node), x, y + 15, size=_SIZE, bold=True, **middle, **head))
        out.append(words(cost_text(node), x, y + _HEAD + 16, size=_SIZE, **middle))
        faint: dict[str, Any] = {"class_": "mmp-faint", "fill": FAINT}
        out.append(words(_foot(node), x, y + _HEAD + 32, size=_SMALL, **middle, **faint))
        return group(node, *out)

    def _frame(self, node: TreeNode, left: float, y: float, color: str) -> list[str]:
        width, height, corner = self.width, self.height, 5.0
        head = (
            f"M{left:.1f} {y + _HEAD:.1f}V{y + corner:.1f}a{corner} {corner} 0 0 1 {corner} {-corner}"
            f"h{width - 2 * corner:.1f}a{corner} {corner} 0 0 1 {corner} {corner}V{y + _HEAD:.1f}z"
        )
        place = {"x": left, "y": y, "width": width, "height": height, "rx": corner}
        dashed = None if node.expanded or node.conflicts == 0 else "4 3"
        line = (
            {"class_": "mmp-solution", "stroke": SOLUTION_PATH}
            if node.on_solution_path
            else {"class_": "mmp-line", "stroke": INK}
        )
        thick = 3.0 if node.on_solution_path else 1.2
        out = [
            element("rect", **place, fill=BODY, class_="mmp-body"),
            element("path", d=head, fill=color),
            element("rect", **place, fill="none", stroke_width=thick, stroke_dasharray=dashed, **line),
        ]
        if node.fast_track:
            out.append(bolt(left + self.width - 16, y + _HEAD + 7, 14.0))
        return out


def bolt(x: float, y: float, height: float) -> str:
    """Returns the mark of the fast track, a flash of lightning."""
    shape = ((0.45, 0), (0.0, 0.58), (0.28, 0.58), (0.14, 1.0), (0.66, 0.38), (0.36, 0.38), (0.66, 0))
    points = " ".join(f"{x + height * a:.1f},{y + height * b:.1f}" for a, b in shape)
    return element("polygon", points=points, fill=BOLT, class_="mmp-bolt")


def _foot(node: TreeNode) -> str:
    return f"node {node.number}" + (f", expanded {ordinal(node.expanded)}" if node.expanded else "")


def ordinal(number: int) -> str:
    """Returns 1st, 2nd, 3rd, 4th ..."""
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
