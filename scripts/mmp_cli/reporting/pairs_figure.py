"""The pairwise figure: two planners on every instance that both have solved, in time and in expanded nodes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mmp_cli.reporting.drawing import FAINT, Drawing, Look, counts, decades, drawn, finished, logarithmic, words
from mmp_cli.reporting.sections import Runs, Section, commonly_solved
from mmp_env.wording import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PAIRS = 4
_FIELDS = (("planning_time_s", "planning time [s]"), ("expanded_nodes", "expanded nodes"))


def pairs_figure(section: Section, reference: str, looks: Mapping[str, Look], name: str) -> Drawing | None:
    """The reference against up to four others of each field that share most solved instances; None where none does."""
    mine = next((run for run in section.successful if run.label == reference), None)
    if mine is None:
        return None
    others = [run for run in section.successful if run is not mine and commonly_solved([run, mine])]
    rows = [(field, told, kept) for field, told in _FIELDS if (kept := _kept(others, mine, field))]
    if not rows:
        return None
    # Panels come out nearly square: the rest of the size is for the words around them.
    columns = max(len(kept) for _, _, kept in rows)
    with drawn(2.45 * columns + 1.2, 3.2 * len(rows)) as figure:
        panels = figure.subplots(len(rows), columns, sharex="row", sharey="row", squeeze=False)
        for (field, told, kept), row in zip(rows, panels, strict=True):
            _draw_row(row, kept, mine, field, told, looks)
        caption = (
            f"Pairwise, {section.name}: each point is an instance that both have solved; below the diagonal "
            f"{reference} needs less. The number after × is the median of the other's value by the reference's, "
            "over the instances where not both are 0."
        )
        treeless = [run.label for run in others if not _points(run, mine, "expanded_nodes")[0].size]
        if treeless and len(rows) > 1:
            caption += f" Without a conflict tree, and so without nodes: {', '.join(treeless)}."
        return finished(figure, name, caption)


def _kept(others: Sequence[Runs], mine: Runs, field: str) -> list[Runs]:
    """Of the planners that have values of the field, the four that share most solved instances."""
    having = [run for run in others if _points(run, mine, field)[0].size]
    most = sorted(having, key=lambda run: -len(commonly_solved([run, mine])))[:_MOST_PAIRS]
    return [run for run in having if run in most]


def _draw_row(
    row: Sequence[Axes], others: Sequence[Runs], mine: Runs, field: str, what: str, looks: Mapping[str, Look]
) -> None:
    """One field, a panel per pair, all with the same limits."""
    from_zero = field == "expanded_nodes"
    values = np.concatenate([np.concatenate(_points(run, mine, field)) for run in others])
    low, high = (-0.4, max(12.0, values.max() * 2)) if from_zero else decades(values.min(), values.max())
    for axes in row[len(others) :]:
        axes.set_visible(False)
    for axes, run in zip(row, others, strict=False):
        x, y = _points(run, mine, field)
        look = looks[run.label]
        axes.plot([low, high], [low, high], color=FAINT, linewidth=1, zorder=1)
        axes.scatter(x, y, s=22, color=look.colour, marker=look.marker, alpha=0.7, linewidths=0, zorder=2)
        logarithmic(axes, which="xy", from_zero=from_zero)
        if from_zero:
            axes.set_xticks(counts(high / 2))
            axes.set_yticks(counts(high / 2))
        axes.set_xlim(low, high)
        axes.set_ylim(low, high)
        axes.set_title(_summary(x, y), fontsize=9.5, loc="left")
        axes.set_xlabel(f"{words(run.label)}\n{what}" if axes is row[0] else words(run.label))
    row[0].set_ylabel(f"{words(mine.label)}\n{what}")


def _summary(x: np.ndarray, y: np.ndarray) -> str:
    """The median ratio where it exists and is not 0, and of how many points it is: 0 by 0 has none."""
    ratios = [a / b if b else math.inf for a, b in zip(x, y, strict=True) if a or b]
    ratio = float(np.median(ratios)) if ratios else math.nan
    if not (math.isfinite(ratio) and ratio > 0):
        return counted(x.size, "instance")
    told = counted(len(ratios), "instance") if len(ratios) == x.size else f"{len(ratios)} of {x.size} instances"
    return f"{told}, ×{ratio:.2g}"


def _points(run: Runs, mine: Runs, field: str) -> tuple[np.ndarray, np.ndarray]:
    """The field of both where both have it."""
    pairs = [(getattr(run.by_problem[p], field), getattr(mine.by_problem[p], field)) for p in
             commonly_solved([run, mine])]  # fmt: skip
    kept = np.array([pair for pair in pairs if None not in pair], dtype=np.float64).reshape(-1, 2)
    if field == "planning_time_s":
        kept = np.maximum(kept, 1e-6)
    return kept[:, 0], kept[:, 1]
