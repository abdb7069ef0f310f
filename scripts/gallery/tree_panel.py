"""A small conflict tree as it grows, painted beside the cell."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

from gallery.fonts import FAINT, INK, LINE, PAPER, SOLUTION_PATH, font
from mmp_env.view.search_tree import SearchTree
from mmp_env.view.tree_drawing.colors import conflict_color, text_color
from mmp_env.view.tree_layout import layout
from mmp_env.view.tree_record import TreeNode

_FINER = 3
_HEAD = 58
_BOX = (76, 24)
_LABEL, _LABEL_ROW = 10.5, 13
_COLUMN, _ROW = 98, 79
_SIDE, _FOOT = 8, 10


class TreePanel:
    """Draws pictures of `width` x `height` pixels of the first nodes of a tree."""

    def __init__(self, tree: SearchTree, width: int, height: int) -> None:
        self._tree, self._size = tree, (width, height)
        self._places = self._place(layout(tree.parents))
        self._most = max((node.conflicts or 0 for node in tree.nodes), default=0)

    def picture(self, shown: int, current: int | None = None, *, solved: bool = False) -> UInt8[np.ndarray, "h w 3"]:
        """Draws the first `shown` nodes, marks `current`, and with `solved` highlights the path to the solution."""
        width, height = self._size
        image = Image.new("RGB", (width * _FINER, height * _FINER), PAPER)
        draw = ImageDraw.Draw(image)
        self._words(draw, width / 2, 20, "The conflict tree", 14, INK, bold=True)
        self._words(draw, width / 2, 41, "in a node: conflicts that are left", 11.5, FAINT)
        nodes = self._tree.nodes[:shown]
        for node in nodes:
            if node.parent is not None:
                self._edge(draw, node, highlight=solved and node.on_solution_path)
        for node in nodes:
            self._node(draw, node, highlight=solved and node.on_solution_path, current=node.id == current)
        return np.array(image.resize(self._size, Image.Resampling.LANCZOS))

    def _place(self, places: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Returns the middles of the boxes [px], with room for text between them if the panel is large enough."""
        width, height = self._size
        across, down = np.maximum(places.max(axis=0), 1e-9)
        column = min(_COLUMN, (width - 2 * _SIDE - _BOX[0]) / across)
        row = min(_ROW, (height - _HEAD - _FOOT - _BOX[1]) / down)
        left = (width - column * places[:, 0].max()) / 2
        return np.column_stack([left + column * places[:, 0], _HEAD + _BOX[1] / 2 + row * places[:, 1]])

    def _edge(self, draw: ImageDraw.ImageDraw, node: TreeNode, *, highlight: bool) -> None:
        parent = node.parent
        assert parent is not None
        (x0, y0), (x1, y1) = self._places[parent], self._places[node.id]
        labels = _label(node)
        begin, end = y0 + _BOX[1] / 2, y1 - _BOX[1] / 2 - 7
        top = end - _LABEL_ROW * len(labels)
        share = np.linspace(0, 1, 25)
        smooth = 3 * share**2 - 2 * share**3
        points = [(x0 + (x1 - x0) * s, begin + (top - 1 - begin) * t) for s, t in zip(smooth, share, strict=True)]
        color, wide = (SOLUTION_PATH, 3.4) if highlight else (LINE, 1.5)
        draw.line([(x * _FINER, y * _FINER) for x, y in points], fill=color, width=round(wide * _FINER), joint="curve")
        for k, text in enumerate(labels):
            middle = top + _LABEL_ROW * (k + 0.5)
            self._words(draw, x1, middle, text, _LABEL, SOLUTION_PATH if highlight else FAINT)

    def _node(self, draw: ImageDraw.ImageDraw, node: TreeNode, *, highlight: bool, current: bool) -> None:
        x, y = self._places[node.id]
        half = np.array(_BOX) / 2
        color = conflict_color(node.conflicts, self._most)
        if current:
            self._box(draw, x, y, half + 4.5, None, INK, 1.8)
        self._box(draw, x, y, half, color, SOLUTION_PATH if highlight else INK, 3.0 if highlight else 1.2)
        self._words(draw, x, y, str(node.conflicts), 14, text_color(color), bold=True)

    def _box(
        self,
        draw: ImageDraw.ImageDraw,
        x: float,
        y: float,
        half: Float[np.ndarray, "2"],
        fill: str | None,
        outline: tuple[int, int, int],
        thick: float,
    ) -> None:
        corners = [x - half[0], y - half[1], x + half[0], y + half[1]]
        wide = round(thick * _FINER)
        draw.rounded_rectangle([side * _FINER for side in corners], 6 * _FINER, fill, outline, wide)

    def _words(
        self,
        draw: ImageDraw.ImageDraw,
        x: float,
        y: float,
        text: str,
        size: float,
        color: str | tuple[int, int, int],
        *,
        bold: bool = False,
    ) -> None:
        """Draws text with its middle at (x, y)."""
        draw.text((x * _FINER, y * _FINER), text, color, font(size * _FINER, bold=bold), anchor="mm")


def _label(node: TreeNode) -> list[str]:
    """Returns the difference of a node from its parent in one or two lines."""
    if node.fast_track:
        return ["fast track:", f"{node.arm or 'several arms'} aside"]
    first, _, rest = (node.constraint or "").partition(" avoids ")
    return [f"{first} avoids", rest] if rest else [first]
