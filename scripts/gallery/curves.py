"""Draws how the plans of `auto` get better over time, from the lines of bench_anytime.py in docs/results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from measured import read_figures

from mmp_cli.reporting.figure_style import logarithmic, new_figure, plot_styles, rendered, width_of
from mmp_env import MmpError
from mmp_env.files.writing import write_text

_PREFIX = "anytime_"
_WIDTH, _HEIGHT = 8.4, 3.2
_LEAST_COST, _MOST_COST = 0.99, 2.0


def save_curves(path: Path) -> None:
    """Writes the picture. Raises `MmpError` if no curve is measured."""
    curves = {name.removeprefix(_PREFIX): line for name, line in read_figures().items() if name.startswith(_PREFIX)}
    if not curves:
        raise MmpError("docs/results/figures.jsonl has no curves; scripts/bench_anytime.py measures them")
    write_text(path, curves_picture(curves))


def curves_picture(curves: Mapping[str, Mapping[str, Any]]) -> str:
    """Returns the SVG: instances with a plan, and median cost up to 2, over the planning time; a curve per cell."""
    styles = plot_styles(list(curves))
    with new_figure(_WIDTH + width_of(curves), _HEIGHT) as figure:
        solved, cost = figure.subplots(1, 2)
        for cell, line in curves.items():
            look = {"color": styles[cell].colour, "linestyle": styles[cell].dashes, "label": cell}
            solved.plot(line["seconds"], [100 * share for share in line["solved"]], **look)
            known = [(t, c) for t, c in zip(line["seconds"], line["cost"], strict=True) if c is not None]
            cost.plot(*zip(*known, strict=True), **look)
        solved.set_ylabel("instances with a plan [%]")
        cost.set_ylabel("median cost, x the straight lines")
        cost.set_ylim(_LEAST_COST, _MOST_COST)
        for axes in (solved, cost):
            logarithmic(axes, which="x")
            axes.set_xlabel("planning time [s]")
        figure.legend(*solved.get_legend_handles_labels(), loc="outside right center")
        return rendered(figure, "anytime", "Plans of auto over time").svg
