"""Writes docs/reference/planners.md from the registered planners and the measured figures.

Usage: planners_page.py [--check]

Descriptions, papers, guarantees and options come from the classes of planners and constraint kinds, figures from
docs/results (`measured.py`). With --check the script writes nothing, and the exit code is 1 if the page is out of date.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterable, Iterator
from typing import Any

from measured import ROOT, Figures, read_figures
from planner_tables import as_table, kind_table, linked, outcome, sources
from quoted import shown as shown_figure
from readme_table import cpu_line
from written_pages import bring_up_to_date, checking_parser

import mmp_planners
from mmp_cli.main import run_script
from mmp_planners.conflict_tree.constraints import EitherArm
from mmp_planners.conflict_tree.constraints.named import KINDS as CONSTRAINTS
from mmp_planners.conflict_tree.constraints.named import constraint_kind
from mmp_planners.registry import Option, load

PAGE = ROOT / "docs" / "reference" / "planners.md"
TREE = "conflict tree"
KINDS = {
    "auto": "portfolio and improvement",
    "group-rrt": "composite planning of groups",
    "rrt-connect": "composite planning",
    "prioritized": "prioritized planning",
    **dict.fromkeys(("apf-ecbs", "apf-ecbs-nf", "ecbs", "gen-ecbs", "xecbs", "cbs", "cbs-mp"), TREE),
}
"""Kind of search of each planner, in the order of the page."""

HEAD = """# Planners

<!-- Written by scripts/planners_page.py from the planners' classes and the figures in docs/results. Do not edit. -->

Call a planner with `mmp plan --planner NAME --set option=value`, or with `mmp_planners.make("NAME", option=value)` in
Python. `mmp list` lists the installed planners, [plug-ins](../how-to/add-a-planner.md) included. Each planner certifies
its plan at every instant, and the independent [checker](../explanation/checking.md) proves the plan again. The same
seed gives the same plan.

## Which one

| you want | use |
| --- | --- |
| a good plan without choosing | {default} |
{choices}

No planner here is complete. If a planner fails, a solution may still exist. They fail on different instances, so try
another one.

"""

CHOICES = {
    "group-rrt": "a quick first plan, also of many arms (`shorten=0` returns it without shortcuts, and longer)",
    "rrt-connect": "the baseline of composite planning",
    "prioritized": "one arm after the other, without a conflict tree",
    "apf-ecbs": "the paper's algorithm with our defaults (`preset=paper` has the paper's): few nodes",
    "ecbs": "the same search without repulsion",
    "gen-ecbs": "several constraint kinds in one search",
    "cbs": "the cheapest plan of the tree, for few arms",
}

MEASURED = """## Measured

Each entry has four parts: instances solved; median / 90th percentile of the planning time, certificate included; mean
number of expanded nodes; median cost ratio (cost divided by the straight lines from start to goal). Times, nodes and
costs count solved instances only, as in `mmp report`. A planner that solves only easy instances therefore looks good.

A dash alone means: not measured. A dash for the nodes means: no conflict tree. One core of: {cpu}.
[Results](../results/README.md#measuring) names commits, time limits, and the command that repeats the measurement.

"""

CONSTRAINT_KINDS = """A constraint kind says what a branch of the conflict tree forbids an arm. Choose it with
`--set constraint=NAME` for `cbs`, `ecbs`, `xecbs`, `apf-ecbs-nf` and `apf-ecbs`. All kinds but `split` treat both arms
alike. A kind is complete if its branches together lose no solution
([proof for `split`](../explanation/proofs.md#completeness-of-split)); the sampling low level may still lose some. The
instant of a conflict is its start in the first tree, its middle in the second, and start, middle and end in the third,
and so on. Trees also differ in the choice of conflict and in the reach of `avoid-state`
([design decisions](../explanation/paper.md#design-decisions)).
"""


def main() -> None:
    """Writes the page, or reports that it is out of date."""
    check = checking_parser("planners_page.py", __doc__).parse().check
    bring_up_to_date({PAGE: "".join(page(read_figures()))}, check=check)


def page(figures: Figures) -> Iterator[str]:
    """Yields the page in parts."""
    names = ours()
    choices = "\n".join(f"| {words} | `{name}` |" for name, words in CHOICES.items() if name in names)
    yield HEAD.format(default="`auto`" if "auto" in names else "`apf-ecbs`", choices=choices)
    yield as_table(origins(names))
    yield "\n" + MEASURED.format(cpu="; ".join(next(cpu_line(figures))))
    for rings in (True, False):
        yield as_table(measured(figures, names, sources(figures, rings=rings))) + "\n"
    yield from beside_published(figures, names)
    yield from failures(figures, names)
    shared = shared_options(names)
    yield "## Each planner\n\n"
    for name in names:
        yield from section(name, shared if KINDS[name] == TREE else ())
    yield "## Options of every conflict-tree planner\n\n"
    yield as_table(option_rows(shared)) + "\n"
    yield from constraint_kinds(figures)


def ours() -> list[str]:
    """Returns the registered planners of this package in the order of the page; each must have a kind."""
    found = {name for name in mmp_planners.names() if load(name).__module__.startswith("mmp_planners.")}
    if found - KINDS.keys():
        sys.exit(f"planners_page.py: KINDS does not say what {', '.join(sorted(found - KINDS.keys()))} is")
    return [name for name in KINDS if name in found]


def origins(names: Iterable[str]) -> Iterator[list[str]]:
    """Yields the rows of the table of papers and guarantees."""
    yield ["planner", "kind", "paper", "guarantee"]
    for name in names:
        about = mmp_planners.describe(name).about
        yield [f"[`{name}`](#{name})", KINDS[name], linked(about), about.guarantee if about else "–"]


def measured(figures: Figures, names: Iterable[str], where: list[str]) -> Iterator[list[str]]:
    """Yields the rows of the table of outcomes."""
    yield ["planner", *(f"`{source}`" for source in where)]
    for name in names:
        yield [f"`{name}`", *(_told(outcome(figures, source, name)) for source in where)]


def _told(parts: list[str]) -> str:
    return "; ".join(parts) if len(set(parts)) > 1 else parts[0]


def beside_published(figures: Figures, names: list[str]) -> Iterator[str]:
    """Yields the table of costs beside the costs published for the same instances."""
    rows = []
    for key, figure in figures.items():
        source, _, rest = key.partition("/")
        planner, _, what = rest.rpartition("/")
        if what == "cost_mean_beside_published" and planner.split(" ")[0] in names:
            rows.append([f"`{source}`", f"`{planner}`", str(figure["instances"]), f"{figure['value']:.2f} rad"])
            rows[-1].append(f"{figure['ratio']:.3f} ({figure['ratio_to']})")
    if rows:
        yield "Mean cost on the instances that a published planner solved, too:\n\n"
        yield as_table(iter([["instances", "planner", "solved by both", "cost", "relative to"], *rows])) + "\n"


def failures(figures: Figures, names: list[str]) -> Iterator[str]:
    """Yields the names of unsolved instances, and the number of runs with an error in all kept benchmarks."""
    yield "Not solved within the time limit, or ended as the brackets say:\n\n"
    lines = []
    for name in names:
        for source in [*sources(figures, rings=True), *sources(figures, rings=False)]:
            failed = figures.get(f"{source}/{name}/solved", {}).get("failed")
            if failed:
                shown = [each if status == "timeout" else f"{each} ({status})" for each, status in failed.items()]
                lines.append(f"- `{name}` on {source}: {', '.join(shown)}\n")
    yield "".join(lines) or "- none\n"
    # The figures of some folders have a second name without the folder.
    wrong = sum(figures[key]["value"] for key in figures if re.fullmatch("[^/]+/[^/]+/[^/]+/errors", key))
    yield f"\nRuns with status `error`, which includes plans that the checker refutes: {wrong}.\n\n"


def section(name: str, shared: tuple[Option, ...]) -> Iterator[str]:
    """Yields the section of one planner."""
    found = mmp_planners.describe(name)
    yield f"### {name}\n\n{prose(load(name))}\n\n"
    if found.about:
        yield f"{linked(found.about)}. Guarantee: {found.about.guarantee}.\n\n"
    own = [option for option in found.options if option not in shared]
    if own:
        yield as_table(option_rows(own)) + "\n"
    if shared:
        yield "Also the [options of every conflict-tree planner](#options-of-every-conflict-tree-planner).\n\n"


def shared_options(names: Iterable[str]) -> tuple[Option, ...]:
    """Returns the options that all conflict-tree planners have with the same default."""
    trees = [mmp_planners.describe(name).options for name in names if KINDS[name] == TREE]
    return tuple(option for option in trees[0] if all(option in options for options in trees))


def option_rows(options: Iterable[Option]) -> Iterator[list[str]]:
    """Yields the rows of a table of options."""
    yield ["`--set`", "default", "what"]
    for option in options:
        yield [f"`{option.name}`", f"`{shown(option.default)}`", option.doc.replace("|", "\\|")]


def shown(value: Any) -> str:
    """Returns a default as you write it after `--set`."""
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)


def constraint_kinds(figures: Figures) -> Iterator[str]:
    """Yields the constraint kinds, from their classes, and how `ecbs` does with each."""
    yield "## Constraint kinds\n\n"
    yield CONSTRAINT_KINDS
    for name in CONSTRAINTS:
        kind = constraint_kind(name, pad=0.25)
        yield f"\n### {name}\n\n{prose(type(kind.kind if isinstance(kind, EitherArm) else kind))}\n"
    yield "\n### Measured effect of the constraint kind\n\n`ecbs` on `MultiArmCell-4`, seeds 0 to 19, 10 s:\n\n"
    yield as_table(kind_table(figures))
    path, state = (
        shown_figure(f"{kind}/planning_time_mean / {kind}/expanded_nodes_mean", "time", figures)
        for kind in (f"kinds/MultiArmCell-4/{name}" for name in ("avoid-path", "avoid-state"))
    )
    yield f"\n`avoid-path` and `priority-path` need few nodes and much time for each: {path} per node with\n"
    yield f"`avoid-path`, against {state} with `avoid-state`. Therefore `avoid-state` is the default.\n"


def prose(kind: type) -> str:
    """Returns a docstring as running text; keeps paragraphs, and line breaks after a sentence."""
    return re.sub(r"(?<![.:\n])\n(?!\n)", " ", inspect.getdoc(kind) or "")


if __name__ == "__main__":
    run_script(main)
