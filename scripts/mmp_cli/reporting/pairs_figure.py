"""The pairwise figure: planning time and expanded nodes of two planners on the instances that both have solved."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mmp_cli.reporting.figure_style import (
    FAINT,
    PlotStyle,
    RenderedFigure,
    counts,
    decades,
    label_text,
    logarithmic,
    new_figure,
    rendered,
)
from mmp_cli.reporting.sections import PlannerRuns, Section, commonly_solved
from mmp_env.wording import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PAIRS = 4
_FIELDS = (("planning_time_s", "planning time [s]"), ("expanded_nodes", "expanded nodes"))


def pairs_figure(section: Section, reference: str, styles: Mapping[str, PlotStyle], name: str) -> RenderedFigure | None:
    """Returns the reference against the up to four planners per field with most common solved instances, or None."""
    mine = next((run for run in section.successful if run.label == reference), None)
    if mine is None:
        return None
    others = [run for run in section.successful if run is not mine and commonly_solved([run, mine])]
    rows = [(field, text, kept) for field, text in _FIELDS if (kept := _kept(others, mine, field))]
    if not rows:
        return None
    # The panels become nearly square; the rest of the size is for the text around them.
    columns = max(len(kept) for _, _, kept in rows)
    with new_figure(2.45 * columns + 1.2, 3.2 * len(rows)) as figure:
        panels = figure.subplots(len(rows), columns, sharex="row", sharey="row", squeeze=False)
        for (field, text, kept), row in zip(rows, panels, strict=True):
            _draw_row(row, kept, mine, field, text, styles)
        caption = (
            f"Pairwise, {section.name}: each point is an instance that both have solved; below the diagonal "
            f"{reference} needs less. The number after × is the median of the other's value by the reference's, "
            "over the instances where not both are 0."
        )
        treeless = [run.label for run in others if not _points(run, mine, "expanded_nodes")[0].size]
        if treeless and len(rows) > 1:
            caption += f" Without a conflict tree, and so without nodes: {', '.join(treeless)}."
        return rendered(figure, name, caption)


def _kept(others: Sequence[PlannerRuns], mine: PlannerRuns, field: str) -> list[PlannerRuns]:
    """Returns the four planners with values of the field that share most solved instances."""
    having = [run for run in others if _points(run, mine, field)[0].size]
    most = sorted(having, key=lambda run: -len(commonly_solved([run, mine])))[:_MOST_PAIRS]
    return [run for run in having if run in most]


def _draw_row(
    row: Sequence[Axes],
    others: Sequence[PlannerRuns],
    mine: PlannerRuns,
    field: str,
    what: str,
    styles: Mapping[str, PlotStyle],
) -> None:
    """Draws one field: a panel per pair, all with the same limits."""
    from_zero = field == "expanded_nodes"
    values = np.concatenate([np.concatenate(_points(run, mine, field)) for run in others])
    low, high = (-0.4, max(12.0, values.max() * 2)) if from_zero else decades(values.min(), values.max())
    for axes in row[len(others) :]:
        axes.set_visible(False)
    for axes, run in zip(row, others, strict=False):
        x, y = _points(run, mine, field)
        style = styles[run.label]
        axes.plot([low, high], [low, high], color=FAINT, linewidth=1, zorder=1)
        axes.scatter(x, y, s=22, color=style.colour, marker=style.marker, alpha=0.7, linewidths=0, zorder=2)
        logarithmic(axes, which="xy", from_zero=from_zero)
        if from_zero:
            axes.set_xticks(counts(high / 2))
            axes.set_yticks(counts(high / 2))
        axes.set_xlim(low, high)
        axes.set_ylim(low, high)
        axes.set_title(_summary(x, y), fontsize=9.5, loc="left")
        axes.set_xlabel(f"{label_text(run.label)}\n{what}" if axes is row[0] else label_text(run.label))
    row[0].set_ylabel(f"{label_text(mine.label)}\n{what}")


def _summary(x: np.ndarray, y: np.ndarray) -> str:
    """Returns the number of points and, unless it is 0, the median ratio; points at 0 have no ratio."""
    ratios = [a / b if b else math.inf for a, b in zip(x, y, strict=True) if a or b]
    ratio = float(np.median(ratios)) if ratios else math.nan
    if not (math.isfinite(ratio) and ratio > 0):
        return counted(x.size, "instance")
    text = counted(len(ratios), "instance") if len(ratios) == x.size else f"{len(ratios)} of {x.size} instances"
    return f"{text}, ×{ratio:.2g}"


def _points(run: PlannerRuns, mine: PlannerRuns, field: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the field of both planners where both have it."""
    pairs = [(getattr(run.by_problem[p], field), getattr(mine.by_problem[p], field)) for p in
             commonly_solved([run, mine])]  # fmt: skip
    kept = np.array([pair for pair in pairs if None not in pair], dtype=np.float64).reshape(-1, 2)
    if field == "planning_time_s":
        kept = np.maximum(kept, 1e-6)
    return kept[:, 0], kept[:, 1]
