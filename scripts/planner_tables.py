"""Makes the tables of planner results on README and docs from the measured figures."""

from __future__ import annotations

import re
from collections.abc import Iterator

from measured import Figures
from quoted import seconds

import mmp_planners
from mmp_planners.planner import About

PLANNERS = {
    "auto": "default: a cheap plan in short time",
    "rrt-connect": "a quick first plan, of all arms at once",
    "prioritized": "one arm after the other",
    "apf-ecbs": "the paper's algorithm with our defaults: repulsion keeps its tree small",
    "apf-ecbs-nf": "`apf-ecbs` without the fast track",
    "ecbs": "no repulsion, a larger tree",
    "xecbs": "`ecbs` that reuses the paths of the parent node",
    "gen-ecbs": "several constraint kinds in one search",
    "cbs": "cheapest plan of its tree, for few arms",
    "cbs-mp": "`cbs` with the constraints of CBS-MP",
}
"""Use of each planner."""
_GALLERY_COLUMNS = 5
OPTIONS = {
    "apf-ecbs": "the defaults",
    "gradient": "gradient steps of size `alpha`",
    "alpha-10": "gradient steps, and ten times the α of the paper",
    "k_rep-10": "gradient steps, and ten times the k_rep of the paper",
    "centre-distance": "distances between sphere centres",
    "centre": "distances between sphere centres, and gradient steps",
    "no-floor": "no floor of the distance",
    "no-cap": "no cap of a step, which normalised steps never reach",
    "gradient-no-cap": "gradient steps, and no cap",
    "no-stretch": "no limit of the distance between waypoints",
    "all-iterations": "all 50 iterations of ModifyMotion",
    "one-arm": "one critical arm; its misses are discarded",
    "discarded": "misses are discarded",
    "at-expansion": "the fast track is tried on a node that would be branched next",
    "literal-hits": "a success of the fast track replaces the node",
    "earliest-conflict": "every tree branches on the earliest conflict",
    "constant-pad": "each tree has the same `pad`",
    "literal-track": "one critical arm, before a node is branched; misses are discarded, a success replaces the node",
    "improve": "200 iterations of SI-RRT\\* after the first path",
    "no-direct": "no straight lines are tried first",
    "no-static-tree": "no static tree of the goal",
    "no-shortcuts": "single-arm paths are not shortened",
    "patience": "the search waits for the bound",
    "w-1.2": "w = 1.2",
    "w-2": "w = 2",
    "one-tree": "one tree",
    "vertex": "vertex constraint, with a radius of 0.2 rad",
    "vertex-0.05": "vertex constraint, with a radius of 0.05 rad",
    "paper": "the preset `paper`: the settings of the paper that we know",
}
"""Variant of `scripts/benchmarks.py` -> the option that it changes."""
_REPULSION = (
    *("cbs repulsion=fast-track", "xecbs repulsion=fast-track", "gen-ecbs repulsion=fast-track"),
    *("apf-ecbs shorten_paths=on", "apf-ecbs shorten=25", "apf-ecbs shorten=100", "apf-ecbs shorten=400"),
    *("ecbs shorten=400", "apf-ecbs fast_track_at=expansion"),
    *("apf-ecbs conflict_choice=earliest", "apf-ecbs pad_growth=1", "apf-ecbs last_resort=off"),
    *("apf-ecbs static_tree=off", "apf-ecbs floor=0"),
    *("apf-ecbs parked_yield=on", "apf-ecbs halvings=3", "apf-ecbs exact_within=0.03"),
)
"""Planners and options that `scripts/bench_repulsion.py` compares with the planners' defaults."""
_VARIANTS = ("literal/MultiArmCell-4", "decisions/MultiArmCell-4")
KINDS = ("avoid-state", "vertex", "avoid-path", "sphere", "priority", "priority-path", "split")
TASKS = ("crossing", "parallel", "pick", "place", "packing")
_TASK_PLANNERS = ("auto", "apf-ecbs", "prioritized")
NOT_MEASURED = "–"


def sources(figures: Figures, *, rings: bool) -> list[str]:
    """Returns the environment ids, or the instance files, that planners were run on, in the order of the file."""
    names = dict.fromkeys(name.split("/")[0] for name in figures if name.endswith("/solved") and name.count("/") == 2)
    return [name for name in names if name.startswith("MultiArmCell") == rings]


def outcome(figures: Figures, source: str, planner: str) -> list[str]:
    """Returns solved; median and 90th percentile of the time; mean of expanded nodes; median of the cost ratio."""
    solved, median, p90, nodes, cost = (figures.get(f"{source}/{planner}/{key}") for key in _OUTCOME)
    if solved is None:
        return [NOT_MEASURED] * 4
    parts = [f"{solved['value']} {solved['unit']}"]
    parts.append(f"{seconds(median['value'])} / {seconds(p90['value'])}" if median and p90 else NOT_MEASURED)
    parts.append(format(nodes["value"], ".3g") if nodes else NOT_MEASURED)
    parts.append(f"{cost['value']:.2f}" if cost else NOT_MEASURED)
    return parts


_OUTCOME = ("solved", "planning_time_median", "planning_time_p90", "expanded_nodes_mean", "cost_median")


def gallery_table(figures: Figures) -> str:
    """Returns the planners in tables of five columns: drawing, use, paper and results with eight arms."""
    names = list(PLANNERS)
    parts = [names[k : k + _GALLERY_COLUMNS] for k in range(0, len(names), _GALLERY_COLUMNS)]
    return "\n".join(as_table(_gallery_rows(figures, part)).replace("---", ":---:") for part in parts)


def _gallery_rows(figures: Figures, planners: list[str]) -> Iterator[list[str]]:
    yield ["", *(f"[`{name}`](docs/reference/planners.md#{name})" for name in planners)]
    yield ["**tool paths**", *(f"![tool paths](docs/images/gallery/paths-{name}.svg)" for name in planners)]
    yield ["**use**", *(PLANNERS[name] for name in planners)]
    abouts = [mmp_planners.describe(name).about for name in planners]
    papers = [linked(about, short=True) if about and about.url else "a portfolio of others" for about in abouts]
    yield ["**paper**", *papers]
    outcomes = [_on_largest_ring(figures, name) for name in planners]
    for row, label in enumerate(("solved", "median time", "median cost ratio")):
        yield [f"**{label}**", *(outcome[row] for outcome in outcomes)]


def _on_largest_ring(figures: Figures, planner: str) -> tuple[str, str, str]:
    """Returns solved, median time and median cost on the largest ring that the planner was measured on."""
    for ring in ("MultiArmCell-8", "MultiArmCell-6", "MultiArmCell-4"):
        if f"{ring}/{planner}/solved" in figures:
            solved, time, _, cost = outcome(figures, ring, planner)
            named = solved if ring == "MultiArmCell-8" else f"{solved} on `{ring}`"
            return named, time.partition(" / ")[0], cost
    return NOT_MEASURED, NOT_MEASURED, NOT_MEASURED


def linked(about: About | None, *, short: bool = False) -> str:
    """Returns the paper of a planner with its link; `short`: the authors' names, or the first of many, and the year."""
    if about is None:
        return "–"
    paper = about.paper
    if short:
        authors, year = paper.partition(":")[0].split(", "), re.search(r"\b\d{4}\b", paper)
        names = f"{authors[0]} et al." if len(authors) > 2 else " and ".join(authors)
        paper = f"{names} {year[0]}" if year else names
    return f"[{paper}]({about.url})" if about.url else paper


def option_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the effect of each design decision on `apf-ecbs`."""
    yield ["variant", "change", "solved", "time", "expanded nodes", "cost"]
    first, second = _VARIANTS
    others = [variant for variant in OPTIONS if f"{first}/{variant}/solved" not in figures]
    for variant, words in OPTIONS.items():
        if variant not in others:
            yield [f"`{variant}`", words, *outcome(figures, first, variant)]
    for variant in ("apf-ecbs", *others):  # measured after those above, so they have the defaults of their own
        words = "the defaults, beside the rows below" if variant == "apf-ecbs" else OPTIONS[variant]
        yield [f"`{variant}`", words, *outcome(figures, second, variant)]


def kind_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the results of `ecbs` with each constraint kind."""
    yield ["`constraint`", "solved", "mean expanded nodes of solved instances"]
    for kind in KINDS:
        solved, _, nodes, _ = outcome(figures, "kinds/MultiArmCell-4", kind)
        yield [f"`{kind}`", solved, nodes]


def task_table(figures: Figures) -> Iterator[list[str]]:
    """Yields solved, time and cost of three planners on the demonstrations."""
    yield ["task", *(f"`{planner}`" for planner in _TASK_PLANNERS)]
    for task in TASKS:
        cell = f"task-{task}/MultiArmCell-mixed-4"
        yield [f"`{task}`", *(_solved_time_cost(figures, f"{cell}/{planner}") for planner in _TASK_PLANNERS)]


def _solved_time_cost(figures: Figures, name: str) -> str:
    solved, median, cost = (figures.get(f"{name}/{key}") for key in ("solved", "planning_time_median", "cost_median"))
    if solved is None or median is None or cost is None:
        return NOT_MEASURED
    return f"{solved['value']} {solved['unit']}, {seconds(median['value'])}, {cost['value']:.2f}"


def node_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the expanded nodes of ecbs and apf-ecbs on instances that both solve."""
    yield ["instances", "solved by both", "`ecbs`", "`apf-ecbs`", "ratio"]
    for name in sources(figures, rings=True) + sources(figures, rings=False):
        figure = figures.get(f"{name}/ecbs/expanded_nodes_where_both_solve")
        if figure is not None:
            base, ratio, count = figure["value"], figure["ratio"], figure["instances"]
            if ratio == 0:  # `ecbs` has no nodes, so the ratio does not tell those of `apf-ecbs`
                yield [name, str(count), "0", NOT_MEASURED, NOT_MEASURED]
                continue
            nodes = base / ratio
            if nodes * count > 1 + 1e-9:  # at one node in all, a mean of 0 has this ratio, too
                yield [name, str(count), f"{base:.3g}", f"{nodes:.3g}", f"{ratio:.2g}"]
            else:
                yield [name, str(count), f"{base:.3g}", f"at most {nodes:.3g}", f"at least {ratio:.0f}"]


def repulsion_table(figures: Figures) -> Iterator[list[str]]:
    """Yields nodes, time and cost of planners with an option, relative to those without it."""
    yield [
        *("planner, option", "cell", "time limit", "solved without", "solved with"),
        *("nodes without", "nodes with", "time", "cost"),
    ]
    for label in _REPULSION:
        cells = [f"{ring}-exact" if "exact_within" in label else ring for ring in ("ring-4", "ring-6", "ring-8")]
        lines = [cell for cell in ("line-16", "line-32", "line-64") if f"repulsion/{label}/nodes_{cell}" in figures]
        for cell in cells + lines:
            nodes, time, cost = (figures.get(f"repulsion/{label}/{what}_{cell}") for what in ("nodes", "time", "cost"))
            if nodes is None or time is None or cost is None:
                yield [f"`{label}`", f"`{cell}`", *[NOT_MEASURED] * 7]
                continue
            limit = f"{nodes['time_limit_s']:g} s" if "time_limit_s" in nodes else NOT_MEASURED
            runs = nodes["instances"] * nodes["seeds"]
            solved = [f"{nodes[key]} of {runs}" for key in ("solved_base", "solved")]
            counts = [format(nodes[key], ".3g") for key in ("of_base", "value")]
            ratios = [f"{1 / time['ratio']:.2f}", f"{1 / cost['ratio']:.3f}"]
            yield [f"`{label}`", f"`{cell}`", limit, *solved, *counts, *ratios]


def as_table(rows: Iterator[list[str]]) -> str:
    """Returns the rows as a Markdown table; the first row is the head."""
    head, *body = rows
    lines = [head, ["---"] * len(head), *body]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
