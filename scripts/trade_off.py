"""The trade-off between nodes and cost: a figure from the kept figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from measured import OURS, Figures

from mmp_cli.reporting.figure_style import INK, RenderedFigure, logarithmic, new_figure, plot_styles, rendered

ARMS = (4, 6, 8)
_PLANNERS = ("ecbs", "apf-ecbs-nf")
_DECISIONS = ("w-1.2", "w-2")
_OPTIONS = ("shorten_paths=on", "shorten=25", "shorten=100", "shorten=400")
_AT_THE_END = "shorten="


@dataclass(frozen=True, kw_only=True)
class Point:
    """Mean nodes of a planner or option, and mean cost relative to `apf-ecbs`, where both solve."""

    label: str
    nodes: float
    cost: float


def points(figures: Figures, arms: int) -> Iterator[Point]:
    """Yields the points of one cell that have been measured; the first is `apf-ecbs`."""
    cell = f"MultiArmCell-{arms}"
    ours = figures.get(f"cells/{cell}/{OURS}/expanded_nodes_mean")
    if ours is not None:
        yield Point(label=OURS, nodes=ours["value"], cost=1.0)
    for folder, labels in (("cells", _PLANNERS), ("decisions", _DECISIONS)):
        for label in labels:
            nodes, cost = (
                figures.get(f"{folder}/{cell}/{label}/{what}_where_both_solve")
                for what in ("expanded_nodes", "cost_rad")
            )
            if nodes and cost:
                yield Point(label=label, nodes=nodes["value"], cost=cost["ratio"])
    for option in _OPTIONS:
        nodes, cost = (figures.get(f"repulsion/{OURS} {option}/{what}_ring-{arms}") for what in ("nodes", "cost"))
        if nodes and cost:
            yield Point(label=option, nodes=nodes["value"], cost=1 / cost["ratio"])


def trade_off_figure(figures: Figures) -> RenderedFigure:
    """Returns a panel for each cell: mean nodes across, relative cost up. A line joins the values of `shorten`."""
    labels = [OURS, *_PLANNERS, *_DECISIONS, *_OPTIONS]
    styles = plot_styles(labels)
    with new_figure(11.0, 3.4) as figure:
        for panel, arms in zip(figure.subplots(1, len(ARMS), sharey=True), ARMS, strict=True):
            drawn = list(points(figures, arms))
            line = [point for point in drawn if point.label == OURS or point.label.startswith(_AT_THE_END)]
            panel.plot([point.nodes for point in line], [point.cost for point in line], color=INK, linewidth=0.8)
            places: dict[tuple[float, float], list[str]] = {}
            for point in drawn:
                panel.plot([point.nodes], [point.cost], styles[point.label].marker, color=styles[point.label].colour)
                places.setdefault((point.nodes, round(point.cost, 3)), []).append(point.label)
            for place, here in places.items():
                panel.annotate(", ".join(here), place, (4, 4), textcoords="offset points", fontsize=7, color=INK)
            logarithmic(panel, which="x", from_zero=True)
            panel.margins(x=0.35, y=0.15)
            panel.set_title(f"{arms} arms", loc="left")
            panel.set_xlabel("mean expanded nodes")
        figure.supylabel("cost relative to apf-ecbs", fontsize=10, color=INK)
        return rendered(figure, "nodes-cost", "")
