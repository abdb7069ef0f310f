"""The conflict trees of `ecbs` and `apf-ecbs` on one instance, side by side, with the means over many."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from measured import Figures, read_figures

from gallery.instances import Search, typical
from mmp_env.files.writing import write_text
from mmp_env.view.search_tree import SearchTree
from mmp_env.view.tree_drawing.colors import FAINT
from mmp_env.view.tree_drawing.discs import DiscStyle, draw_discs
from mmp_env.view.tree_drawing.legend import draw_legend
from mmp_env.view.tree_drawing.svg import element, svg_page, text_width, words

_BOTH = "MultiArmCell-8/ecbs/expanded_nodes_where_both_solve"
_DISCS = DiscStyle(
    name="numbered", expanded=10.5, generated=10.5, column=23.5, row=27.0, solution_width=3.6, numbers=True
)
_BORDER, _BETWEEN = 18.0, 24.0
_TITLE, _TEXT, _LINE = 16.0, 12.5, 19.0
_FAINT: dict[str, Any] = {"class_": "mmp-faint", "fill": FAINT}


def save_comparison(path: Path) -> None:
    """Writes the drawing for the instance whose ratio of expanded nodes is closest to that of the means."""
    figures = read_figures()
    pair = typical(float(figures[_BOTH]["ratio"]))
    write_text(path, comparison(*pair, figures))
    print(f"{path.name}: {pair[0].problem.name}, {pair[0].expanded} and {pair[1].expanded} nodes expanded")


def comparison(first: Search, second: Search, figures: Figures) -> str:
    """Returns the text of an SVG file with light and dark colours."""
    runs = (first, second)
    most = max(node.conflicts or 0 for run in runs for node in run.tree.nodes)
    canvases = [draw_discs(run.tree, _DISCS, None, most) for run in runs]
    out, x, top = [], _BORDER, _BORDER + 2 * _LINE + 28
    for run, canvas in zip(runs, canvases, strict=True):
        out.append(words(run.planner, x, _BORDER + _TITLE, size=_TITLE, bold=True))
        for k, line in enumerate(_subtitle(run)):
            out.append(words(line, x, _BORDER + _TITLE + _LINE * (k + 1), size=_TEXT, **_FAINT))
        wide = max(canvas.width, *(text_width(line, _TEXT) for line in _subtitle(run)))
        aside = x + (wide - canvas.width) / 2
        out.append(element("g", *canvas.edges, *canvas.nodes, transform=f"translate({aside:.1f} {top:.1f})"))
        x += wide + _BETWEEN
    foot = list(_foot(first, second, figures))
    width = max(x - _BETWEEN + _BORDER, *(text_width(line, _TEXT) + 2 * _BORDER for line in foot))
    y = top + max(canvas.height for canvas in canvases) + 4
    legend, high = draw_legend(_together(first.tree, second.tree), "numbered", width - 2 * _BORDER)
    out.append(element("g", *legend, transform=f"translate({_BORDER} {y:.1f})"))
    y += high + 8
    for line in foot:
        y += _LINE
        out.append(words(line, _BORDER, y, size=_TEXT, **_FAINT))
    return svg_page(out, width, y + _BORDER, f"Conflict trees of ecbs and apf-ecbs on {first.problem.name}")


def _subtitle(run: Search) -> list[str]:
    trees = f" in {len(run.tree.roots)} trees" if len(run.tree.roots) > 1 else ""
    ratio = run.plan.cost_rad / run.problem.cost_lower_bound_rad
    return [f"{run.expanded} nodes expanded{trees}", f"cost {ratio:.2f} x the straight lines"]


def _foot(first: Search, second: Search, figures: Figures) -> Iterator[str]:
    """Yields the caption: the instance, and the means over many."""
    figure = figures[_BOTH]
    mean, ratio = figure["value"], figure["ratio"]
    yield (
        f"One instance, {first.problem.name}. Of those on which apf-ecbs expands a node, its ratio of"
        f" expanded nodes, {first.expanded / second.expanded:.1f},"
    )
    ratios = f"{ratio:.1f}: {mean:.1f} against {mean / ratio:.1f} nodes"
    yield f"is closest to that of the means, {ratios}. In a disc: the conflicts that are left."


def _together(first: SearchTree, second: SearchTree) -> SearchTree:
    """Returns a tree with the nodes of both, for the legend."""
    out = SearchTree()
    out.nodes, out.solution = [*first.nodes, *second.nodes], first.solution
    return out
