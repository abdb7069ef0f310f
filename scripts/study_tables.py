"""Tables and heat maps of the study of the paper's claims, from the kept benchmarks."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import study
from measured import kept_sections
from paired import LEAST_BOTH, pair
from study import Setting

from mmp_cli.reporting.figure_style import INK, RenderedFigure, new_figure, rendered
from mmp_cli.reporting.formatting import NOTHING
from mmp_cli.reporting.sections import PlannerRuns, Section

FEWER = 1.5
"""Least ratio of nodes, of `ecbs` to `apf-ecbs`, with which we say that the claim on nodes holds."""
_COLOURS, _MOST = "RdBu", 16.0
"""Colour map of the ratios of nodes, and the ratio of its darkest blue."""


@dataclass(frozen=True, kw_only=True)
class Compared:
    """`apf-ecbs` with one setting in one cell, beside `ecbs`. Ratios are of `ecbs` to `apf-ecbs` where both solve."""

    solved: int
    solved_before: int
    both: int
    nodes: float | None
    time: float | None
    cost: float | None

    @property
    def compares(self) -> bool:
        """Returns whether both solve enough instances for ratios."""
        return self.nodes is not None

    @property
    def holds(self) -> bool:
        """Returns whether there are fewer nodes, and no fewer instances solved."""
        return self.nodes is not None and self.nodes >= FEWER and self.solved >= self.solved_before


def compared(section: Section, setting: Setting) -> Compared:
    """Returns the comparison of a setting with the same setting without repulsion."""
    both = pair(section, setting.baseline, setting.label)
    assert both is not None, f"{setting.label} was not run; leave it out with `measured_rows`"
    ratios = [both.ratio("expanded_nodes"), both.ratio("planning_time_s", median=True), both.ratio("cost_rad")]
    nodes, time, cost = (None if ratio is None else ratio.value for ratio in ratios)
    return Compared(
        solved=len(both.ours.solved),
        solved_before=len(both.theirs.solved),
        both=len(both.both),
        nodes=nodes,
        time=time,
        cost=cost,
    )


def measured_rows(sections: Sequence[Section], rows: Iterable[list[Setting]]) -> list[list[Setting]]:
    """Returns the rows of which every setting was run."""
    labels = {run.label for run in sections[0].runs}
    return [row for row in rows if all(setting.label in labels for setting in row)]


def steps_table(folder: Path) -> Iterator[list[str]]:
    """Yields, for each d_0, the values of alpha with which the claim on nodes holds, and the value that solves most."""
    sections = kept_sections(folder)
    arms = [f"{section.arms} arms" for section in sections]
    yield [
        *("distance", "d_0 [m]", *(f"α, {name}" for name in arms)),
        *("best α", "solved", "by both", "nodes", "time", "cost"),
    ]
    for distance in study.RANGES:
        for row in measured_rows(sections, study.steps(distance)):
            table = {setting: [compared(section, setting) for section in sections] for setting in row}
            holds = [_holding(row, [table[s][k] for s in row]) for k in range(len(sections))]
            best = max(row, key=lambda setting: sum(cell.solved for cell in table[setting]))
            yield [
                *(distance, row[0].d0, *holds),
                *_best(best, table[best]),
            ]


def _best(setting: Setting, cells: Sequence[Compared]) -> list[str]:
    """Returns alpha, the instances solved by our planner, by the baseline, and by both, and the ratios of all cells."""
    solved = " / ".join(f"{cell.solved} ({cell.solved_before})" for cell in cells)
    both = " / ".join(str(cell.both) for cell in cells)
    ratios = [[getattr(cell, name) for cell in cells] for name in ("nodes", "time", "cost")]
    return [setting.alpha, solved, both, *(" / ".join(map(_ratio, values)) for values in ratios)]


def _ratio(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.3g}"


def _holding(row: Sequence[Setting], cells: Sequence[Compared]) -> str:
    """Returns the values of alpha with which the claim holds, neighbours as a range, or a dash if nothing compares.

    Behind it is the least and the largest number of instances that both planners solve.
    """
    if not any(cell.compares for cell in cells):
        return NOTHING
    parts: list[list[str]] = [[]]
    for setting, cell in zip(row, cells, strict=True):
        if cell.holds:
            parts[-1].append(setting.alpha)
        elif parts[-1]:
            parts.append([])
    found = ", ".join(part[0] if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts if part) or "none"
    counts = sorted({cell.both for cell in cells})
    return f"{found} (n = {counts[0]} to {counts[-1]})" if len(counts) > 1 else f"{found} (n = {counts[0]})"


def long_table(folder: Path) -> Iterator[list[str]]:
    """Yields the instances solved within parts of the long time limit."""
    limit = json.loads((folder / "settings.json").read_text(encoding="utf-8"))["time_limit_s"]
    limits = [limit / 100, limit / 10, limit]
    yield ["arms", "planner", *(f"solved in {limit:g} s" for limit in limits), "expanded nodes, unsolved"]
    for section in kept_sections(folder):
        for run in section.runs:
            solved = [sum((line.planning_time_s or 0) <= limit for line in run.solved) for limit in limits]
            yield [str(section.arms), f"`{run.label}`", *(f"{n} of {len(run.valid)}" for n in solved), _unsolved(run)]


def _unsolved(run: PlannerRuns) -> str:
    nodes = [int(line.expanded_nodes) for line in run.unsolved if line.expanded_nodes is not None]
    return ", ".join(map(str, nodes)) or NOTHING


def verdict(folder: Path) -> str:
    """Returns sentences on the settings with which the claim on nodes holds."""
    sections = kept_sections(folder)
    rows = [row for distance in study.RANGES for row in measured_rows(sections, study.steps(distance))]
    settings = [setting for row in rows for setting in row]
    table = {setting: [compared(section, setting) for section in sections] for setting in settings}
    solved = {setting: sum(cell.solved for cell in cells) for setting, cells in table.items()}
    ratios = {setting: _listed(_ratio(cell.nodes) for cell in cells) for setting, cells in table.items()}
    paper, surfaces, most = Setting(), study.SURFACES, max(solved.values())
    best = [setting for setting in settings if solved[setting] == most]
    before = sum(cell.solved_before for cell in table[paper])
    count = sum(len(section.instances) for section in sections)
    holds = [sum(cells[k].holds for cells in table.values()) for k in range(len(sections))]
    everywhere = [setting for setting, cells in table.items() if all(cell.holds for cell in cells)]
    more = [sum(cells[k].solved > cells[k].solved_before for cells in table.values()) for k in range(len(sections))]
    arms = _listed(section.arms for section in sections)
    sentences = (
        f"Of {count} instances with {arms} arms, `ecbs-paper`, without repulsion, solves {before}.",
        f"The preset `paper` solves {solved[paper]}, and the ratio of the nodes is {ratios[paper]}.",
        "With the values of the preset, distances between surfaces and a floor of 1 cm,",
        f"it solves {solved[surfaces]}, and the ratio of the nodes is {ratios[surfaces]}.",
        f"Most, {most}, are solved with {_named(best)}.\n",
        f"The nodes are at least {FEWER:g} times fewer, with no fewer instances solved, for {_listed(holds)} of the",
        f"{len(settings)} combinations of distance, d_0 and α,",
        f"and for {len(everywhere)} in all cells" + (f":\n{_named(everywhere)}." if everywhere else "."),
        f"`apf-ecbs` solves more instances than `ecbs-paper` with {_listed(more)} of them.",
        *_time_and_cost([table[max(row, key=solved.__getitem__)] for row in rows]),
        f"A dash means that fewer than {LEAST_BOTH} instances are solved both with and without repulsion.\n",
    )
    return "\n".join(sentences)


def _time_and_cost(rows: Sequence[Sequence[Compared]]) -> Iterator[str]:
    """Yields sentences on time and cost with the settings of a table that solve most; a row has all cells."""
    faster = [sum((cell.time or 0.0) > 1 for cell in cells) for cells in zip(*rows, strict=True)]
    costs = [cell.cost for cells in rows for cell in cells if cell.cost is not None]
    yield "With the best α of each row of the table below, the median time is below that of `ecbs-paper` in"
    yield f"{_listed(faster)} of {len(rows)} rows."
    if costs:
        yield f"The cost of `ecbs-paper` is {min(costs):.3f} to {max(costs):.3f} times that of `apf-ecbs`."


def _named(settings: Sequence[Setting]) -> str:
    """Returns the options of settings that differ from the preset."""
    return _listed(f"`distance={each.distance}{each.floor} d0={each.d0} alpha={each.alpha}`" for each in settings)


def _listed(parts: Iterable[object]) -> str:
    *first, last = map(str, parts)
    return f"{', '.join(first)} and {last}" if first else last


PICTURES = {
    "study-steps": "Ratio of nodes for each step size and influence distance",
    "study-search": "Ratio of nodes for each number of iterations and each radius of the vertex constraint",
}


def heat_map_links(folder: Path) -> str:
    """Returns the heat maps as Markdown."""
    del folder
    return "\n".join(f"![{words}](paper/{name}.svg)\n" for name, words in PICTURES.items())


def save_heat_maps(folder: Path, target: Path) -> None:
    """Draws the heat maps of the kept benchmark `folder`."""
    sections = kept_sections(folder)
    for figure in heat_maps(sections):
        (target / f"{figure.name}.svg").write_text(figure.svg, encoding="utf-8")


def heat_maps(sections: Sequence[Section]) -> Iterator[RenderedFigure]:
    """Yields the heat maps: steps, and iterations with radii."""
    steps = [
        Map(
            grid=grid,
            title=f"distance={distance}",
            down="d_0 [m]",
            across="α",
            rows=[row[0].d0 for row in grid],
            columns=study.ALPHAS,
        )
        for distance in study.RANGES
        for grid in (measured_rows(sections, study.steps(distance)),)
    ]
    paper, larger = (f"α={step.alpha},\nd_0={step.d0}" for step in (Setting(), study.LARGER_STEPS))
    search = [
        Map(
            grid=study.iterations(),
            title="α=1e-5",
            down="d_0 [m]",
            across="iterations",
            rows=study.RANGES["centre"],
            columns=study.ITERATIONS,
        ),
        Map(
            grid=study.radii(),
            title="",
            down="",
            across="radius [rad]",
            rows=(paper, larger),
            columns=study.RADII,
        ),
    ]
    for name, maps in zip(PICTURES, (steps, search), strict=True):
        yield _drawn(name, sections, maps)


@dataclass(frozen=True, kw_only=True)
class Map:
    """Settings in rows and columns, and the words around them."""

    grid: list[list[Setting]]
    title: str
    down: str
    across: str
    rows: Sequence[str]
    columns: Sequence[str]


def _drawn(name: str, sections: Sequence[Section], maps: Sequence[Map]) -> RenderedFigure:
    """Returns one row of panels for each map, with a panel for each cell.

    A field has the ratio of nodes and, below, the instances that `apf-ecbs`, (in brackets) `ecbs`, and both solve.
    """
    heights = [0.5 * len(each.rows) + 0.75 for each in maps]
    with new_figure(4.0 * len(sections) + 0.6, sum(heights)) as figure:
        panels = figure.subplots(
            len(maps), len(sections), squeeze=False, gridspec_kw={"height_ratios": [len(each.rows) for each in maps]}
        )
        for each, line in zip(maps, panels, strict=True):
            for section, panel in zip(sections, line, strict=True):
                cells = [[compared(section, setting) for setting in row] for row in each.grid]
                shades = [[math.nan if c.nodes is None else math.log(c.nodes, _MOST) for c in row] for row in cells]
                panel.imshow(shades, cmap=_COLOURS, vmin=-1, vmax=1, aspect="auto")
                for y, row in enumerate(cells):
                    for x, cell in enumerate(row):
                        color = "white" if abs(shades[y][x]) > 0.6 else INK
                        text = f"{_ratio(cell.nodes)}\n{cell.solved} ({cell.solved_before}), {cell.both}"
                        panel.text(x, y, text, ha="center", va="center", fontsize=7, color=color)
                panel.set_xticks(range(len(each.columns)), each.columns, fontsize=8)
                panel.set_yticks(range(len(each.rows)), each.rows, fontsize=8)
                panel.tick_params(length=0)
                panel.grid(visible=False)
                panel.set_xlabel(each.across)
                panel.set_title(f"{section.arms} arms" + (f", {each.title}" if each.title else ""), loc="left")
            line[0].set_ylabel(each.down)
        return rendered(figure, name, "")
