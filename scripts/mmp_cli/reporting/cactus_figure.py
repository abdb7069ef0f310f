"""The cactus plot: number of solved instances over the planning time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mmp_cli.reporting.comparison import Comparison, Entry
from mmp_cli.reporting.figure_style import (
    FAINT,
    INK,
    PlotStyle,
    RenderedFigure,
    decades,
    label_text,
    logarithmic,
    new_figure,
    plot_styles,
    rendered,
    width_of,
)
from mmp_cli.reporting.sections import Section

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_TOGETHER = 6
"""Largest number of curves in one panel; with more, each gets a panel of its own."""
_COLUMNS = 5
Curve = tuple[str, Sequence[float], PlotStyle]
"""Name, planning times of the solved instances [s], at least one, and style."""
_SHORTEST_S = 1e-6
"""Smallest time [s] on the logarithmic axis."""


def cactus_figure(
    section: Section, styles: Mapping[str, PlotStyle], name: str, limit_s: float | None
) -> RenderedFigure | None:
    """Returns the plot of our results, or None if nothing is solved. `limit_s` is the time limit [s], or None."""
    curves = []
    for run in section.successful:
        times = [line.planning_time_s for line in run.solved if line.planning_time_s is not None]
        curves += [(run.label, times, styles[run.label])] if times else []
    if not curves:
        return None
    most = max(len(run.valid) for run in section.runs)
    end = max(_last(curves), limit_s or 0.0)
    caption = (
        f"Cactus plot, {section.name}: solved instances against the planning time that is allowed. Higher and "
        "farther left is better."
    )
    if len(curves) > _MOST_TOGETHER:
        return _panel_each(curves, most, end, name, f"{caption} Grey in each panel: the other planners.")
    with new_figure(7.2 + width_of(label for label, _, _ in curves), max(3.6, 1.2 + 0.24 * len(curves))) as figure:
        axes = figure.subplots()
        _draw(axes, curves, most, _first(curves), end)
        axes.set_ylabel(f"solved, of {most}")
        figure.legend(loc="outside right center")
        return rendered(figure, name, caption)


def _panel_each(curves: Sequence[Curve], most: int, end: float, name: str, caption: str) -> RenderedFigure:
    """Draws a panel for each planner, with the curves of the others behind it in grey."""
    rows = math.ceil(len(curves) / _COLUMNS)
    with new_figure(2.3 * _COLUMNS, 0.5 + 2.1 * rows) as figure:
        panels = figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False).flat
        for curve, panel in zip(curves, panels, strict=False):
            for _, times, _ in curves:
                panel.step(*_steps(times, end), where="post", color=FAINT, alpha=0.45, linewidth=1, rasterized=True)
            _draw(panel, [curve], most, _first(curves), end)
            panel.set_title(label_text(curve[0]), loc="left")
            panel.set_xlabel("")
            panel.tick_params(labelbottom=True)
        for unused in panels:
            unused.set_axis_off()
        figure.supxlabel("planning time [s]", fontsize=10, color=INK)
        figure.supylabel(f"solved, of {most}", fontsize=10, color=INK)
        return rendered(figure, name, caption)


def published_figure(comparison: Comparison, styles: Mapping[str, PlotStyle], name: str) -> RenderedFigure | None:
    """Returns the plot of our and the published results on common instances, or None if a side has solved nothing."""
    ours = [entry for entry in comparison.entries if not entry.published and entry.times]
    theirs = [entry for entry in comparison.entries if entry.published and entry.times]
    if not (ours and theirs):
        return None
    theirs_look = plot_styles([entry.label for entry in theirs])
    most = max(entry.tried for entry in comparison.entries)
    sides = [_curves(ours, styles), _curves(theirs, theirs_look)]
    begin, end = min(map(_first, sides)), max(map(_last, sides))
    with new_figure(10.5, 3.4 + 0.24 * max(len(curves) for curves in sides)) as figure:
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for panel, curves, title in zip(panels, sides, ("ours", "published"), strict=True):
            _draw(panel, curves, most, begin, end)
            panel.set_title(title, loc="left")
            panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16))
        panels[0].set_ylabel(f"solved, of {most}")
        caption = (
            f"Ours and published figures on the instances of {comparison.source} that are valid here. Published: "
            f"{comparison.note}. The machines differ."
        )
        return rendered(figure, name, caption)


def _curves(entries: Sequence[Entry], styles: Mapping[str, PlotStyle]) -> list[Curve]:
    return [(entry.label, list(entry.times.values()), styles[entry.label]) for entry in entries]


def _last(curves: Sequence[Curve]) -> float:
    return max(max(times) for _, times, _ in curves)


def _first(curves: Sequence[Curve]) -> float:
    return min(min(times) for _, times, _ in curves)


def _steps(times: Sequence[float], end: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the corners of a curve, up to `end`: times [s] and numbers of solved instances."""
    xs = np.maximum(np.sort(times), _SHORTEST_S)
    counts = np.arange(1, xs.size + 1)
    return np.append(xs, max(end, _SHORTEST_S)), np.append(counts, counts[-1])


def _draw(axes: Axes, curves: Sequence[Curve], most: int, begin: float, end: float) -> None:
    """Draws the curves up to the time `end` [s], on an axis that begins at `begin` or earlier."""
    from matplotlib.ticker import MaxNLocator

    for label, times, style in curves:
        axes.step(
            *_steps(times, end),
            where="post",
            color=style.colour,
            linestyle=style.dashes,
            marker=style.marker,
            markevery=(0, max(1, len(times) // 6)),
            markersize=5,
            label=label_text(label),
        )
    logarithmic(axes, which="x")
    axes.set_xlim(*decades(begin, max(end, _SHORTEST_S)))
    axes.set_ylim(0, most * 1.04)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    axes.set_xlabel("planning time [s]")
