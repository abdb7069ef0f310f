"""Writes the tables of measured figures into README.md and pages of docs. Usage: readme_table.py [--check]

The figures are the lines of docs/results/figures.jsonl, which the `bench_*.py` print; of several with one name the last
one counts. A table stands between `<!-- table: NAME -->` and `<!-- end of table -->`. With --check nothing is written,
and the exit code is 1 where a page is not up to date.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from written_pages import bring_up_to_date, checking_parser, filled

import mmp_planners
from mmp_cli.standalone import run_script
from mmp_planners.planner import About

ROOT = Path(__file__).parent.parent
FIGURES = ROOT / "docs" / "results" / "figures.jsonl"
PAGES = (ROOT / "README.md", ROOT / "docs" / "architecture.md", ROOT / "docs" / "paper.md")

PLANNERS = {
    "auto": "the default: a cheap plan, soon",
    "rrt-connect": "a first plan at once, at any cost",
    "prioritized": "one arm after the other: short ways, no tree",
    "apf-ecbs": "the paper's planner: repulsion keeps its tree small",
    "apf-ecbs-nf": "the same without the fast track",
    "ecbs": "the paper's baseline: no repulsion, a larger tree",
    "xecbs": "`ecbs` that plans on from its parent's paths",
    "gen-ecbs": "constraints of several kinds in one search",
    "cbs": "the cheapest plan of its tree, for few arms",
    "cbs-mp": "`cbs` with the constraints of its paper",
}
"""Planner -> what it is good at."""
_GALLERY_COLUMNS = 5
OPTIONS = {
    "": "the defaults",
    "step=gradient": "gradient steps of `alpha`, as in the paper",
    "distance=centre step=gradient": "and distances between sphere centres",
    "early_stop=off": "all 50 iterations of ModifyMotion",
    "fast_track=literal": "the fast track as in the paper",
    "restarts=off": "one tree, as in the paper",
    "constraint=vertex": "the paper's vertex constraint, with a radius",
}
CORE = {
    "cell_check_8x28": "kinematics and least clearance over the 28 pairs of 8 UR5e, in a batch, a state",
    "cell_check_8x28_single_state": "the same, one state at a time",
    "conflicts_8_arms": "all conflicts of 8 motions, proved between the steps",
    "force_field_one_of_8_arms": "the repulsive force on one motion from 7 others",
    "certificate_8_arms": "the certificate of a plan for 8 arms",
    "env_reset_given": "`reset` of `MultiArmCell-8` to a given instance",
    "env_step": "`step` of `MultiArmCell-8`",
    "import": "`import mmp_env, mmp_planners` beyond MuJoCo and Gymnasium",
}
"""Figure -> what it says."""

Figures = Mapping[str, Mapping[str, Any]]


def main() -> None:
    """Brings the pages up to date, or says that they are not."""
    check = checking_parser("readme_table.py", __doc__).parse().check
    figures = read_figures(FIGURES)
    pages = {page: filled(page.read_text(encoding="utf-8"), lambda name: TABLES[name](figures)) for page in PAGES}
    bring_up_to_date(pages, check=check)


def read_figures(path: Path) -> dict[str, dict[str, Any]]:
    """Name -> line."""
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return {line["name"]: line for line in lines}


def sources(figures: Figures, *, rings: bool) -> list[str]:
    """What planners were run on, in the order of the file: environment ids, or instance files."""
    names = dict.fromkeys(name.split("/")[0] for name in figures if name.count("/") == 2)
    return [name for name in names if name.startswith("MultiArmCell") == rings]


def outcome(figures: Figures, source: str, planner: str) -> str:
    """A cell of a table: solved, median and 90th percentile of the time, mean of expanded nodes, median of the cost."""
    solved, median, p90, nodes, cost = (figures.get(f"{source}/{planner}/{key}") for key in _OUTCOME)
    if solved is None or median is None or p90 is None:
        return "–"
    text = f"{solved['value']} {solved['unit']}; {seconds(median['value'])} / {seconds(p90['value'])}"
    if cost is None:
        return text
    return f"{text}; {'–' if nodes is None else format(nodes['value'], '.3g')}; {cost['value']:.2f}"


_OUTCOME = ("solved", "planning_time_median", "planning_time_p90", "expanded_nodes_mean", "cost_median")


def seconds(value: float) -> str:
    """A time as people read it."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if value * factor >= 1:
            shown = value * factor
            return f"{shown:.0f} {unit}" if shown >= 10 else f"{shown:#.2g} {unit}"
    return f"{value * 1e9:.0f} ns"


def gallery_table(figures: Figures) -> str:
    """The planners in rows of five: a drawing, what each is good at, its paper, and how it does with eight arms."""
    names = list(PLANNERS)
    parts = [names[k : k + _GALLERY_COLUMNS] for k in range(0, len(names), _GALLERY_COLUMNS)]
    return "\n".join(as_table(_gallery_rows(figures, part)).replace("---", ":---:") for part in parts)


def _gallery_rows(figures: Figures, planners: list[str]) -> Iterator[list[str]]:
    yield [f"[`{name}`](docs/planners.md#{name})" for name in planners]
    yield [f"![ways of the tools](docs/images/gallery/ways-{name}.svg)" for name in planners]
    yield [PLANNERS[name] for name in planners]
    abouts = [mmp_planners.describe(name).about for name in planners]
    yield [linked(about, short=True) if about and about.url else "a portfolio of others" for about in abouts]
    yield [_brief(figures, name) for name in planners]


def _brief(figures: Figures, planner: str) -> str:
    """Solved, median time and cost on the largest ring that it was measured on."""
    for ring in ("MultiArmCell-8", "MultiArmCell-6", "MultiArmCell-4"):
        solved, median, _, _, cost = (figures.get(f"{ring}/{planner}/{key}") for key in _OUTCOME)
        if solved and median and cost:
            text = f"{solved['value']} {solved['unit']}, {seconds(median['value'])}, {cost['value']:.2f}"
            return text if ring == "MultiArmCell-8" else f"`{ring}`: {text}"
    return "–"


def linked(about: About | None, *, short: bool = False) -> str:
    """Where a planner is from; `short`: the first author and the year."""
    if about is None:
        return "–"
    paper = about.paper
    if short:
        authors, year = paper.partition(":")[0].split(", "), re.search(r"\b\d{4}\b", paper)
        paper = " ".join([authors[0], *(["et al."] if len(authors) > 1 else []), *([year[0]] if year else [])])
    return f"[{paper}]({about.url})" if about.url else paper


def option_table(figures: Figures) -> Iterator[list[str]]:
    """What the rulings are worth: apf-ecbs with the paper's letter instead."""
    rings = sources(figures, rings=True)
    runs = {option: f"apf-ecbs {option}".strip() for option in OPTIONS}
    rings = [ring for ring in rings if any(f"{ring}/{runs[option]}/solved" in figures for option in OPTIONS if option)]
    yield ["`--set`", "what", *(f"`{ring}`" for ring in rings)]
    for option, words in OPTIONS.items():
        yield [f"`{option}`" if option else "–", words, *(outcome(figures, ring, runs[option]) for ring in rings)]


def node_table(figures: Figures) -> Iterator[list[str]]:
    """Expanded nodes of ecbs and apf-ecbs where both solve."""
    yield ["instances", "solved by both", "`ecbs`", "`apf-ecbs`", "ratio"]
    for name in sources(figures, rings=True) + sources(figures, rings=False):
        figure = figures.get(f"{name}/ecbs/expanded_nodes_where_both_solve")
        if figure is not None:
            base, ratio = figure["value"], figure["ratio"]
            yield [name, str(figure["instances"]), f"{base:.3g}", f"{base / ratio:.3g}", f"{ratio:.2g}"]


def core_table(figures: Figures) -> Iterator[list[str]]:
    """Small things, and how they compare."""
    yield ["what", "time", "compared"]
    scale = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
    for name, words in CORE.items():
        figure = figures.get(name)
        if figure is not None:
            compared = ""
            if "ratio" in figure:
                # Against MuJoCo's own collision test a ratio says how many times faster, elsewhere how much longer.
                relation = "times as fast as" if figure["ratio_to"].startswith("mj_kin") else "times the time of"
                compared = f"{figure['ratio']:.2g} {relation} `{figure['ratio_to']}`"
            yield [words, seconds(figure["value"] * scale[figure["unit"]]), compared]


def cpu_line(figures: Figures) -> Iterator[list[str]]:
    """On what it was measured."""
    yield sorted({figure["cpu"] for figure in figures.values() if "cpu" in figure})


def as_table(rows: Iterator[list[str]]) -> str:
    """Markdown, the first row being the head."""
    head, *body = rows
    lines = [head, ["---"] * len(head), *body]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


TABLES = {
    "gallery": gallery_table,
    "nodes": lambda figures: as_table(node_table(figures)),
    "options": lambda figures: as_table(option_table(figures)),
    "core": lambda figures: as_table(core_table(figures)),
    "cpu": lambda figures: "; ".join(next(cpu_line(figures))) + "\n",
}

if __name__ == "__main__":
    run_script(main)
