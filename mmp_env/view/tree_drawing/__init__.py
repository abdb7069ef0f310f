"""The conflict tree as an SVG drawing: few nodes are boxes with text, many are coloured discs.

It needs no graph library: `mmp_env.view.tree_layout` computes the layout, and this package the size of the text.
"""

from __future__ import annotations

from typing import Any

from mmp_env.view.tree_drawing.boxes import draw_boxes
from mmp_env.view.tree_drawing.canvas import Canvas, enlarged
from mmp_env.view.tree_drawing.colors import FAINT, SOLUTION_PATH
from mmp_env.view.tree_drawing.discs import DOTS, NUMBERED, draw_discs
from mmp_env.view.tree_drawing.legend import draw_legend
from mmp_env.view.tree_drawing.node_text import solution_path_texts, tree_summary
from mmp_env.view.tree_drawing.svg import cut, element, svg_page, text_width, words
from mmp_env.view.tree_layout import layout
from mmp_env.view.tree_record import TreeRecord

_MOST_BOXES, _BOX_COLUMNS = 40, 10
_MOST_NUMBERED, _NUMBERED_COLUMNS = 260, 48
_BORDER, _LEAST_WIDTH = 20.0, 520.0
_TITLE, _SUBTITLE, _STEP = 17.0, 12.5, 12.0
_MOST_STEPS = 12
_SHAPE = 1.5
"""Wanted ratio of width to height of a forest, which determines the number of its rows."""

__all__ = ["draw_tree"]


def draw_tree(tree: TreeRecord) -> str:
    """Returns the drawing as the text of an SVG file. A tree without nodes is drawn too: the drawing says so."""
    canvas = _canvas(tree)
    title, subtitle = tree.title or "Conflict tree", tree_summary(tree)
    inner = max(canvas.width, _LEAST_WIDTH, text_width(subtitle, _SUBTITLE))
    large = enlarged(inner)
    head, y = _head(tree, title, subtitle, canvas.style, inner / large)
    out = [element("g", *head, transform=f"translate({_BORDER} {_BORDER}) scale({large:.3f})")]
    y = _BORDER + large * y
    aside = _BORDER + (inner - canvas.width) / 2
    out.append(element("g", *canvas.edges, *canvas.nodes, transform=f"translate({aside:.1f} {y:.1f})"))
    y += canvas.height
    if canvas.style != "boxes" and tree.solution_path:
        steps, height = _solution_steps(tree, inner / large)
        out.append(element("g", *steps, transform=f"translate({_BORDER} {y + 8:.1f}) scale({large:.3f})"))
        y += 8 + large * height
    return svg_page(out, inner + 2 * _BORDER, y + _BORDER, f"{title}: {subtitle}")


def _canvas(tree: TreeRecord) -> Canvas:
    """Draws the tree in the most detailed of the three styles that is still legible."""
    count = len(tree.nodes)
    if not count:
        return Canvas(edges=[], nodes=[], width=0.0, height=0.0, style="boxes")
    columns = float(layout(tree.parents)[:, 0].max()) + 1
    if count <= _MOST_BOXES and columns <= _BOX_COLUMNS:
        return draw_boxes(tree)
    if count <= _MOST_NUMBERED and columns <= _NUMBERED_COLUMNS:
        return draw_discs(tree, NUMBERED, None)
    return draw_discs(tree, DOTS, _row_width(tree, columns) if len(tree.roots) > 1 else None)


def _row_width(tree: TreeRecord, columns: float) -> float:
    """Returns the columns of a row of trees with which the drawing is largest in a frame of the wanted shape."""

    def size(width: float) -> float:
        across, down = layout(tree.parents, width=width).max(axis=0) + 2
        return max(across * DOTS.column / _SHAPE, down * DOTS.row)

    return min((columns * 0.8**k for k in range(10)), key=size)


def _head(tree: TreeRecord, title: str, subtitle: str, style: str, width: float) -> tuple[list[str], float]:
    """Returns title, summary and legend, and their height."""
    faint: dict[str, Any] = {"class_": "mmp-faint", "fill": FAINT}
    out = [
        words(cut(title, _TITLE, width, bold=True), 0.0, _TITLE, size=_TITLE, bold=True),
        words(subtitle, 0.0, _TITLE + 22, size=_SUBTITLE, **faint),
    ]
    y = _TITLE + 34
    legend, height = draw_legend(tree, style, width)
    out.append(element("g", *legend, transform=f"translate(0 {y:.1f})", class_="mmp-legend"))
    return out, y + height + 8


def _solution_steps(tree: TreeRecord, width: float) -> tuple[list[str], float]:
    """Returns the steps to the solution as text, as many as there is room for, and their height."""
    steps = [f"{k}. {step}" for k, step in enumerate(solution_path_texts(tree))]
    if len(steps) > _MOST_STEPS:
        steps[_MOST_STEPS - 2 : -1] = [f"... {len(steps) - _MOST_STEPS + 1} more steps"]
    heading: dict[str, Any] = {"class_": "mmp-solution-text", "fill": SOLUTION_PATH}
    out = [words("The path to the solution", 0.0, 12.0, size=_STEP, bold=True, **heading)]
    out += [words(cut(step, _STEP, width), 0.0, 12.0 + 18 * k, size=_STEP) for k, step in enumerate(steps, 1)]
    return out, 18.0 * len(out)
