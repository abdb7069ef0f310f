"""Writes measured figures into README.md and docs, as tables and in the text. Usage: readme_table.py [--check]

`measured.py` says where figures are from, `quoted.py` how the text quotes one. A table stands between
`<!-- table: NAME -->` and `<!-- end of table -->`. With --check nothing is written, and the exit code is 1 where a page
is not up to date.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from measured import ROOT, Figures, read_figures
from quoted import quoted, seconds
from written_pages import bring_up_to_date, checking_parser, filled

import mmp_planners
from mmp_cli.standalone import run_script
from mmp_planners.planner import About

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))

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
    "apf-ecbs": "the defaults",
    "gradient": "gradient steps of `alpha`, as in the paper",
    "centre": "and distances between sphere centres",
    "all-iterations": "all 50 iterations of ModifyMotion",
    "literal-track": "the fast track as in the paper",
    "one-tree": "one tree, as in the paper",
    "vertex": "the paper's vertex constraint, with a radius",
}
"""Variant of `scripts/reproduce_paper.sh` -> what it takes back."""
_LETTER = "letter/MultiArmCell-4"
KINDS = ("avoid-state", "vertex", "avoid-path", "sphere", "priority", "priority-path", "split")
TASKS = ("crossing", "parallel", "pick", "place", "packing")
_TASK_PLANNERS = ("auto", "apf-ecbs", "prioritized")
_DRAWN_CELLS = ("mixed-4", "ring-4", "ring-4-panda", "ring-6", "ring-8")
_RINGS = tuple(f"MultiArmCell-{arms}" for arms in (2, 4, 6, 8))
ENVIRONMENT = {
    "`step` against as many bare `mj_step` calls": ("env_step", "ratio", ".2f"),
    "`step` [ms], of 0.1 s simulated": ("env_step", "value", ".1f"),
    "`reset` to a given instance, validated [ms]": ("env_reset_given", "value", ".1f"),
    "`reset` that draws its instance [ms]": ("env_reset_drawn", "value", ".1f"),
    "`execute`, for a simulated second [ms]": ("execute_per_simulated_second", "value", ".0f"),
}
"""What -> figure, key of its line, and format."""
_NOT_MEASURED = "–"
CORE = {
    "cell_check_8x28": "kinematics and least clearance over the 28 pairs of 8 UR5e, in a batch, a state",
    "cell_check_8x28_single_state": "the same, one state at a time",
    "conflicts_8_arms": "all conflicts of 8 motions, proved between the steps",
    "force_field_one_of_8_arms": "the repulsive force on one motion from 7 others",
    "certificate_8_arms": "the certificate of a plan for 8 arms",
    "MultiArmCell-8/env_reset_given": "`reset` of `MultiArmCell-8` to a given instance",
    "MultiArmCell-8/env_step": "`step` of `MultiArmCell-8`",
    "import": "`import mmp_env, mmp_planners` beyond MuJoCo and Gymnasium",
}
"""Figure -> what it says."""


def main() -> None:
    """Brings the pages up to date, or says that they are not."""
    check = checking_parser("readme_table.py", __doc__).parse().check
    figures = read_figures()
    texts = {page: page.read_text(encoding="utf-8") for page in PAGES}
    pages = {
        page: quoted(filled(text, lambda name: TABLES[name](figures)), figures)
        for page, text in texts.items()
        if page.name != "planners.md"  # written whole, by planners_page.py
    }
    bring_up_to_date(pages, check=check)


def sources(figures: Figures, *, rings: bool) -> list[str]:
    """What planners were run on, in the order of the file: environment ids, or instance files."""
    names = dict.fromkeys(name.split("/")[0] for name in figures if name.endswith("/solved") and name.count("/") == 2)
    return [name for name in names if name.startswith("MultiArmCell") == rings]


def outcome(figures: Figures, source: str, planner: str) -> list[str]:
    """Of a planner: solved; median and 90th percentile of the time, mean of expanded nodes, median of the cost."""
    solved, median, p90, nodes, cost = (figures.get(f"{source}/{planner}/{key}") for key in _OUTCOME)
    if solved is None:
        return [_NOT_MEASURED] * 4
    parts = [f"{solved['value']} {solved['unit']}"]
    parts.append(f"{seconds(median['value'])} / {seconds(p90['value'])}" if median and p90 else _NOT_MEASURED)
    parts.append(format(nodes["value"], ".3g") if nodes else _NOT_MEASURED)
    parts.append(f"{cost['value']:.2f}" if cost else _NOT_MEASURED)
    return parts


_OUTCOME = ("solved", "planning_time_median", "planning_time_p90", "expanded_nodes_mean", "cost_median")


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
        if f"{ring}/{planner}/solved" in figures:
            solved, time, _, cost = outcome(figures, ring, planner)
            text = f"{solved}, {time.partition(' / ')[0]}, {cost}"
            return text if ring == "MultiArmCell-8" else f"`{ring}`: {text}"
    return _NOT_MEASURED


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
    yield ["variant", "what", "solved", "time", "expanded nodes", "cost"]
    for variant, words in OPTIONS.items():
        yield [f"`{variant}`", words, *outcome(figures, _LETTER, variant)]


def kind_table(figures: Figures) -> Iterator[list[str]]:
    """`ecbs` with each constraint kind."""
    yield ["`constraint`", "solved", "mean of expanded nodes where solved"]
    for kind in KINDS:
        solved, _, nodes, _ = outcome(figures, "kinds/MultiArmCell-4", kind)
        yield [f"`{kind}`", solved, nodes]


def task_table(figures: Figures) -> Iterator[list[str]]:
    """The demonstrations: solved, time and cost of three planners."""
    yield ["task", *(f"`{planner}`" for planner in _TASK_PLANNERS)]
    for task in TASKS:
        cell = f"task-{task}/MultiArmCell-mixed-4"
        yield [f"`{task}`", *(_solved_time_cost(figures, f"{cell}/{planner}") for planner in _TASK_PLANNERS)]


def _solved_time_cost(figures: Figures, name: str) -> str:
    solved, median, cost = (figures.get(f"{name}/{key}") for key in ("solved", "planning_time_median", "cost_median"))
    if solved is None or median is None or cost is None:
        return _NOT_MEASURED
    return f"{solved['value']} {solved['unit']}, {seconds(median['value'])}, {cost['value']:.2f}"


def draw_table(figures: Figures) -> Iterator[list[str]]:
    """How long drawing an instance takes, in the median and at most."""
    yield ["cell", *(f"`{task}`" for task in TASKS)]
    for cell in _DRAWN_CELLS:
        rows = [figures.get(f"{cell}/{task}/draw") for task in TASKS]
        yield [f"`{cell}`", *(f"{row['value']:.2f}, {row['max']:.2f}" if row else _NOT_MEASURED for row in rows)]


def environment_table(figures: Figures) -> Iterator[list[str]]:
    """What the environment costs beside the physics."""
    yield ["", *(f"`{ring.removeprefix('MultiArmCell')}`" for ring in _RINGS)]
    for words, (name, key, form) in ENVIRONMENT.items():
        rows = [figures.get(f"{ring}/{name}") for ring in _RINGS]
        yield [words, *(_in_ms(row, key, form) if row else _NOT_MEASURED for row in rows)]


def _in_ms(row: dict[str, Any], key: str, form: str) -> str:
    return format(row[key] / (1e3 if key == "value" and row["unit"] == "us" else 1.0), form)


_RETIME_HEAD = (
    "ratio, median / largest",
    "processor time [ms], median / largest",
    "strays by at most [rad]",
    "valid",
    "goals reached, contacts",
    "tracking error [rad]",
    "torque",
)


def retime_table(figures: Figures) -> Iterator[list[str]]:
    """Retimed plans and their executions."""
    yield ["", *_RETIME_HEAD]
    names = [f"retime_{ring}" for ring in _RINGS[1:]] + [f"retime_MultiArmCell-mixed-4_{task}" for task in TASKS]
    for name in names:

        def value(what: str, form: str, name: str = name) -> str:
            return format(figures[f"{name}_{what}"]["value"], form)

        valid = figures[f"{name}_valid"]
        yield [
            "`-" + name.removeprefix("retime_MultiArmCell-").replace("_", "`, ") + ("" if "_" in name[7:] else "`"),
            f"{value('ratio_median', '.3f')} / {value('ratio_max', '.3f')}",
            f"{value('cpu_ms_median', '.0f')} / {value('cpu_ms_max', '.0f')}",
            value("deviation_rad_max", ".3f"),
            f"{valid['value']} of {valid['of']}",
            f"{value('executed_after_reached', 'd')}, {value('executed_after_contacts', 'd')}",
            value("executed_after_tracking_max", ".5f"),
            value("executed_after_torque_share_max", ".2f"),
        ]


def recording_table(figures: Figures) -> Iterator[list[str]]:
    """What a recording costs."""
    yield ["search", "expanded nodes", "file", "added to planning"]
    for name, row in figures.items():
        what, _, planner = name.partition("/")
        if what == "recording_size":
            added = figures[f"recording_time_added/{planner}"]["value"]
            yield [f"`{planner}`", str(row["expanded_nodes"]), f"{row['value']:.1f} MB", f"{added:.1f} s"]


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
    "kinds": lambda figures: as_table(kind_table(figures)),
    "tasks": lambda figures: as_table(task_table(figures)),
    "draws": lambda figures: as_table(draw_table(figures)),
    "environment": lambda figures: as_table(environment_table(figures)),
    "retime": lambda figures: as_table(retime_table(figures)),
    "recordings": lambda figures: as_table(recording_table(figures)),
    "options": lambda figures: as_table(option_table(figures)),
    "core": lambda figures: as_table(core_table(figures)),
    "cpu": lambda figures: "; ".join(next(cpu_line(figures))) + "\n",
}

if __name__ == "__main__":
    run_script(main)
