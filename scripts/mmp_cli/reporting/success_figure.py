"""Figure of the success rate of each planner in each cell, with its 95 % interval."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from mmp_cli.reporting.figure_style import INK, PlotStyle, RenderedFigure, label_text, new_figure, rendered, width_of
from mmp_cli.reporting.sections import Section
from mmp_cli.reporting.statistics import wilson

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_BESIDE = 3


def success_figure(sections: Sequence[Section], styles: Mapping[str, PlotStyle]) -> RenderedFigure:
    """Returns a figure with a panel per cell and a bar per planner."""
    columns = min(len(sections), _MOST_BESIDE)
    rows = math.ceil(len(sections) / columns)
    with new_figure(1.0 + width_of(styles) + 2.7 * columns, (1.1 + 0.32 * len(styles)) * rows) as figure:
        panels = list(figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).flat)
        for panel in panels:
            panel.set_axis_off()
        for section, panel in zip(sections, panels, strict=False):
            panel.set_axis_on()
            _draw(panel, section, styles)
        figure.supxlabel("solved [%]", fontsize=10, color=INK)
        caption = (
            "Success rate: solved of the valid instances within the time limit. The line is the 95 % interval "
            "of the rate (Wilson) for this number of instances."
        )
        return rendered(figure, "success", caption)


def _draw(panel: Axes, section: Section, styles: Mapping[str, PlotStyle]) -> None:
    """Draws one cell."""
    runs = {run.label: run for run in section.runs}
    for place, label in enumerate(styles):
        run = runs.get(label)
        if run is None or not run.valid:
            panel.text(2, place, "no valid instance" if run else "not run", va="center", fontsize=9)
            continue
        solved, tried = len(run.solved), len(run.valid)
        low, high = wilson(solved, tried)
        panel.barh(place, 100 * solved / tried, height=0.62, color=styles[label].colour, alpha=0.85)
        panel.plot([100 * low, 100 * high], [place, place], color=INK, linewidth=1.2, marker="|", markersize=6)
        panel.text(104, place, f"{solved}/{tried}", va="center", fontsize=9, clip_on=False)
    panel.set_title(label_text(section.name), loc="left")
    panel.grid(axis="y", visible=False)
    panel.set_xlim(0, 100)
    panel.set_xticks([0, 25, 50, 75, 100])
    panel.set_ylim(len(styles) - 0.4, -0.6)
    panel.set_yticks(range(len(styles)), [label_text(label) for label in styles])
    panel.tick_params(axis="both", length=0, labelbottom=True)
