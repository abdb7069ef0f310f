"""Tables and figures in the paper's form, from the kept benchmarks: table I, figures 4 and 5, and the fast track."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from measured import OURS, kept_sections
from paired import Ratio, pair

from mmp_cli.reporting.figure_style import (
    INK,
    PlotStyle,
    RenderedFigure,
    label_text,
    new_figure,
    plot_styles,
    rendered,
    width_of,
)
from mmp_cli.reporting.formatting import NOTHING, mean_and_std, number, share
from mmp_cli.reporting.sections import PlannerRuns, Section, commonly_solved

PUBLISHED_SOLVED = {("ecbs", 4): 76, ("ecbs", 6): 48, ("ecbs", 8): 52}
"""Instances that the paper's planners solve in 1800 s [%], by planner and number of arms, as far as we know them."""
METRICS = {
    "expanded nodes": "expanded_nodes",
    "planning time": "planning_time_s",
    "makespan": "makespan_s",
    "cost": "cost_rad",
}
"""Field of each metric of the paper, in the order of its table."""
_UNITS = {"planning time": " [s]", "makespan": " [s]", "cost": " [rad]"}
NO_FAST_TRACK = "apf-ecbs-nf"

Rows = Iterator[list[str]]


def table_one(folder: Path) -> Rows:
    """Yields success, nodes, time, makespan and cost of each planner on each cell, as in table I of the paper."""
    yield ["arms", "planner", "solved", *(name + _UNITS.get(name, "") for name in METRICS)]
    for section in kept_sections(folder):
        for run in section.runs:
            solved = share(len(run.solved), len(run.valid))
            published = PUBLISHED_SOLVED.get((run.label, section.arms or 0))
            if published is not None:
                solved += f"; paper: {published} %"
            yield [
                str(section.arms),
                f"`{run.label}`",
                solved,
                *(mean_and_std(run.spread(field)) for field in METRICS.values()),
            ]


def figure_five_table(folder: Path) -> Rows:
    """Yields the means over the instances that all planners solve, relative to those of `apf-ecbs`."""
    yield ["arms", "solved by all", "planner", *METRICS]
    for section in kept_sections(folder):
        for label, ratios in relative(section).items():
            shown = [NOTHING if ratio is None else f"{ratio:#.3g}" for ratio in ratios]
            yield [str(section.arms), str(len(section.common)), f"`{label}`", *shown]


def relative(section: Section) -> dict[str, list[float | None]]:
    """Returns each other planner's means of the four metrics, divided by those of `apf-ecbs`."""
    runs = {run.label: run for run in section.successful}
    if OURS not in runs or not section.common:
        return {}
    ours = _means(runs.pop(OURS), section.common)
    pairs = {label: zip(_means(run, section.common), ours, strict=True) for label, run in runs.items()}
    return {label: [x / y if x is not None and y else None for x, y in both] for label, both in pairs.items()}


def _means(run: PlannerRuns, among: Sequence[tuple[str, int]]) -> list[float | None]:
    spreads = [run.spread(field, among=among) for field in METRICS.values()]
    return [values.mean if values else None for values in spreads]


PAIRS = {
    "preset": (("ecbs-paper", "paper"), ("apf-ecbs-nf-paper", "paper"), ("gen-ecbs-paper", "paper")),
    "cells": (("ecbs", OURS), (NO_FAST_TRACK, OURS)),
    "literal": (("ecbs-paper", "paper"), ("ecbs-paper", "paper-surface")),
    "track": tuple(
        (NO_FAST_TRACK, label) for label in ("one-arm", "cover", "discarded", "at-expansion", "literal-track", OURS)
    ),
}
"""Planners of each folder that are compared, the one without repulsion or without the fast track first."""


def pair_table(folder: Path) -> Rows:
    """Yields the ratios of two planners on the instances that both solve, with their 90 % intervals."""
    yield ["arms", "planners", "solved", "solved by both", "nodes", "mean time", "median time", "makespan", "cost"]
    for section in kept_sections(folder):
        for theirs, ours in PAIRS[folder.name]:
            both = pair(section, theirs, ours)
            if both is None:
                continue
            fields = METRICS.values()
            ratios = [both.ratio(field) for field in fields]
            ratios.insert(2, both.ratio("planning_time_s", median=True))
            solved = f"{len(both.theirs.solved)}, {len(both.ours.solved)} of {len(both.ours.valid)}"
            yield [
                *(str(section.arms), f"`{theirs}` / `{ours}`", solved, str(len(both.both))),
                *map(_with_interval, ratios),
            ]


def _with_interval(ratio: Ratio | None) -> str:
    return NOTHING if ratio is None else f"{ratio.value:#.3g} ({ratio.low:#.3g} to {ratio.high:#.3g})"


def fast_track_table(folder: Path, *, ours: str = OURS, without: str = NO_FAST_TRACK) -> Rows:
    """Yields nodes and time with and without the fast track, on instances that both solve, and its hits."""
    yield [
        *("arms", "solved by both", "nodes without", "nodes with", "saved"),
        *("mean time without [s]", "mean time with [s]", "median without [s]", "median with [s]", "hits"),
    ]
    for section in kept_sections(folder):
        runs = {run.label: run for run in section.runs}
        both = commonly_solved([runs[without], runs[ours]])
        nodes, times = (
            [runs[label].spread(field, among=both) for label in (without, ours)]
            for field in ("expanded_nodes", "planning_time_s")
        )
        if None in (*nodes, *times):
            continue
        before, after = (values.mean for values in nodes if values)
        tries, hits = (
            int(sum(getattr(line, f"fast_track_{what}") or 0 for line in runs[ours].valid))
            for what in ("tries", "hits")
        )
        yield [
            *(str(section.arms), str(len(both)), number(before), number(after)),
            f"{100 * (1 - after / before):.0f} %" if before else NOTHING,
            *(number(values.mean) for values in times if values),
            *(number(values.median) for values in times if values),
            share(hits, tries),
        ]


def save_figures(folder: Path, target: Path) -> None:
    """Draws figures 4 and 5 of the paper from the kept benchmark `folder`."""
    sections = kept_sections(folder)
    styles = plot_styles([run.label for run in sections[0].runs])
    target.mkdir(exist_ok=True)
    for figure in (success_figure(sections, styles), relative_figure(sections, styles)):
        save(figure, target)


def save(figure: RenderedFigure, target: Path) -> None:
    """Writes a figure into a folder."""
    (target / f"{figure.name}.svg").write_text(figure.svg, encoding="utf-8")


def success_figure(sections: Sequence[Section], styles: dict[str, PlotStyle]) -> RenderedFigure:
    """Returns the success rates, and those of the paper as outlines."""
    with new_figure(2.2 * len(sections) + 0.8, 3.2) as figure:
        panels = figure.subplots(1, len(sections), sharey=True, squeeze=False)
        for section, panel in zip(sections, panels.flat, strict=True):
            for place, run in enumerate(section.runs):
                rate = 100 * len(run.solved) / len(run.valid)
                panel.bar(place, rate, width=0.62, color=styles[run.label].colour, alpha=0.85)
                published = PUBLISHED_SOLVED.get((run.label, section.arms or 0))
                if published is not None:
                    panel.bar(place, published, width=0.62, fill=False, edgecolor=INK, hatch="///", linewidth=1.2)
            panel.set_title(f"{section.arms} arms", loc="left")
            panel.set_xticks(range(len(section.runs)), [label_text(run.label) for run in section.runs], rotation=60)
            panel.tick_params(axis="both", length=0)
            panel.grid(axis="x", visible=False)
            panel.set_ylim(0, 100)
        figure.supylabel("solved [%]", fontsize=10, color=INK)
        return rendered(figure, "figure-4", "")


def relative_figure(sections: Sequence[Section], styles: dict[str, PlotStyle]) -> RenderedFigure:
    """Returns the four metrics of each planner relative to `apf-ecbs`."""
    labels = [label for label in styles if label != OURS]
    with new_figure(11.0 + width_of(labels), 3.0) as figure:
        panels = figure.subplots(1, len(METRICS))
        for metric, panel in enumerate(panels):
            for k, label in enumerate(labels):
                values = [relative(section).get(label, [None] * len(METRICS))[metric] for section in sections]
                places = [place + (k - 1.5) * 0.2 for place in range(len(sections))]
                heights = [value or 0.0 for value in values]
                panel.bar(places, heights, width=0.18, color=styles[label].colour, alpha=0.85, label=label_text(label))
            panel.axhline(1.0, color=INK, linewidth=1.0)
            panel.set_title(list(METRICS)[metric], loc="left")
            panel.set_xticks(range(len(sections)), [f"{section.arms} arms" for section in sections])
            panel.tick_params(axis="both", length=0)
            panel.grid(axis="x", visible=False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper")
        figure.supylabel("relative to apf-ecbs", fontsize=10, color=INK)
        return rendered(figure, "figure-5", "")
