"""Writes docs/reference/planners.md from the registered planners and the measured figures.

Usage: planners_page.py [--check]

What a planner is, where it is from, what it promises and which options it has comes from its class, the constraint
kinds from theirs, the figures from docs/results (`measured.py`). With --check nothing is written, and the exit code
is 1 where the page is not up to date.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterable, Iterator
from typing import Any

from measured import ROOT, Figures, read_figures
from planner_tables import as_table, linked, outcome, sources
from readme_table import cpu_line
from written_pages import bring_up_to_date, checking_parser

import mmp_planners
from mmp_cli.standalone import run_script
from mmp_planners.conflict_tree.constraints import EitherArm
from mmp_planners.conflict_tree.constraints.named import KINDS as CONSTRAINTS
from mmp_planners.conflict_tree.constraints.named import constraint_kind
from mmp_planners.registry import Option, load

PAGE = ROOT / "docs" / "reference" / "planners.md"
TREE = "conflict tree"
KINDS = {
    "auto": "portfolio, then shortcutting",
    "rrt-connect": "all joints as one space",
    "prioritized": "one arm after the other",
    **dict.fromkeys(("apf-ecbs", "apf-ecbs-nf", "ecbs", "gen-ecbs", "xecbs", "cbs", "cbs-mp"), TREE),
}
"""Planner -> what kind of search it is; in the order of the page."""

HEAD = """# Planners

<!-- Written by scripts/planners_page.py from the planners' classes and the figures in docs/results. Do not edit. -->

Call a planner with `mmp plan --planner NAME --set option=value`, or with `mmp_planners.make("NAME", option=value)` in
Python. `mmp list` lists the installed planners, [plug-ins](../how-to/add-a-planner.md) included. Each planner certifies
its plan at every instant, and the independent [checker](../explanation/checking.md) proves the plan again. The same
seed gives the same plan.

## Which one

| you want | take |
| --- | --- |
| a good plan, and not to think about it | {default} |
{choices}

None of them is complete in practice: one that finds nothing has not shown that there is nothing. They fail on different
instances, so where one gives up another may do.

"""

CHOICES = {
    "rrt-connect": "the first plan as soon as there can be one (`shorten=0`: as it was found, and long)",
    "prioritized": "short ways in crowded cells, and nobody needs a tree",
    "apf-ecbs": "the paper's planner: few nodes, a bound relative to its own path lengths",
    "ecbs": "the baseline of the paper, the same search without repulsion",
    "gen-ecbs": "constraints of every kind in one search",
    "cbs": "the cheapest plan of the tree, where the tree is small",
}

MEASURED = """## Measured

In the columns: solved; median / 90th percentile of the planning time, certificate included; mean number of expanded
nodes; median cost as a multiple of the straight lines. Times, nodes and costs are over the solved instances alone, as
in `mmp report`, so a planner that solves only the easy instances looks good in them.
A dash alone is what was not measured, one for the nodes is a planner without a conflict tree. A dash for the times,
where some instances are unsolved, is an older measurement: its times counted the unsolved ones too, and are left out.
One core of: {cpu}. [docs/results](../results/README.md#measuring) has commits, time limits, and the command that
measures again.

"""


def main() -> None:
    """Brings the page up to date, or says that it is not."""
    check = checking_parser("planners_page.py", __doc__).parse().check
    bring_up_to_date({PAGE: "".join(page(read_figures()))}, check=check)


def page(figures: Figures) -> Iterator[str]:
    """The page in parts."""
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
    yield "## Each of them\n\n"
    for name in names:
        yield from section(name, shared if KINDS[name] == TREE else ())
    yield "## Options of every conflict-tree planner\n\n"
    yield as_table(option_rows(shared)) + "\n"
    yield from constraint_kinds()


def ours() -> list[str]:
    """The planners of this package that are registered, in the order of the page; all must have a kind."""
    found = {name for name in mmp_planners.names() if load(name).__module__.startswith("mmp_planners.")}
    if found - KINDS.keys():
        sys.exit(f"planners_page.py: KINDS does not say what {', '.join(sorted(found - KINDS.keys()))} is")
    return [name for name in KINDS if name in found]


def origins(names: Iterable[str]) -> Iterator[list[str]]:
    """Where they are from, and what they promise."""
    yield ["planner", "kind", "paper", "guarantee"]
    for name in names:
        about = mmp_planners.describe(name).about
        yield [f"[`{name}`](#{name})", KINDS[name], linked(about), about.guarantee if about else "–"]


def measured(figures: Figures, names: Iterable[str], where: list[str]) -> Iterator[list[str]]:
    """What came of them."""
    yield ["planner", *(f"`{source}`" for source in where)]
    for name in names:
        yield [f"`{name}`", *(_told(outcome(figures, source, name)) for source in where)]


def _told(parts: list[str]) -> str:
    return "; ".join(parts) if len(set(parts)) > 1 else parts[0]


def beside_published(figures: Figures, names: list[str]) -> Iterator[str]:
    """Costs beside those that were published for the same instances."""
    rows = []
    for key, figure in figures.items():
        source, _, rest = key.partition("/")
        planner, _, what = rest.rpartition("/")
        if what == "cost_mean_beside_published" and planner.split(" ")[0] in names:
            theirs = figure["value"] / figure["ratio"]
            rows.append([f"`{source}`", f"`{planner}`", str(figure["instances"]), f"{figure['value']:.2f} rad"])
            rows[-1].append(f"{theirs:.2f} rad ({figure['ratio_to']})")
    if rows:
        yield "Mean cost on the instances that a published planner solved as well:\n\n"
        yield as_table(iter([["instances", "planner", "solved by both", "cost", "published"], *rows])) + "\n"


def failures(figures: Figures, names: list[str]) -> Iterator[str]:
    """The instances that were not solved, by name, and the plans that a check refuted."""
    yield "Not solved within the time limit:\n\n"
    lines = []
    for name in names:
        for source in [*sources(figures, rings=True), *sources(figures, rings=False)]:
            failed = figures.get(f"{source}/{name}/solved", {}).get("failed")
            if failed:
                lines.append(f"- `{name}` on {source}: {', '.join(failed)}\n")
    yield "".join(lines) or "- none\n"
    keys = ("/errors", "/plans_failing_check", "/plans_failing_exact_check")
    wrong = sum(figure["value"] for key, figure in figures.items() if key.endswith(keys))
    yield f"\nRuns that ended in an error, as one does whose plan the checker refutes: {wrong}.\n\n"


def section(name: str, shared: tuple[Option, ...]) -> Iterator[str]:
    """One planner."""
    found = mmp_planners.describe(name)
    yield f"### {name}\n\n{prose(load(name))}\n\n"
    if found.about:
        yield f"{linked(found.about)}. Guarantee: {found.about.guarantee}.\n\n"
    own = [option for option in found.options if option not in shared]
    if own:
        yield as_table(option_rows(own)) + "\n"
    if shared:
        yield "And the [options of every conflict-tree planner](#options-of-every-conflict-tree-planner).\n\n"


def shared_options(names: Iterable[str]) -> tuple[Option, ...]:
    """Options that all conflict-tree planners have, with the same default."""
    trees = [mmp_planners.describe(name).options for name in names if KINDS[name] == TREE]
    return tuple(option for option in trees[0] if all(option in options for options in trees))


def option_rows(options: Iterable[Option]) -> Iterator[list[str]]:
    """A table of options."""
    yield ["`--set`", "default", "what"]
    for option in options:
        yield [f"`{option.name}`", f"`{shown(option.default)}`", option.doc.replace("|", "\\|")]


def shown(value: Any) -> str:
    """A default as it is written after `--set`."""
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)


def constraint_kinds() -> Iterator[str]:
    """The constraint kinds, from their classes."""
    yield "## Constraint kinds\n\n"
    yield "What a branch of the conflict tree forbids an arm, `--set constraint=NAME`. A kind is complete "
    yield "when its branches together lose no solution; the sampling low level may lose some all the same.\n"
    for name in CONSTRAINTS:
        kind = constraint_kind(name, pad=0.25)
        yield f"\n### {name}\n\n{prose(type(kind.kind if isinstance(kind, EitherArm) else kind))}\n"


def prose(kind: type) -> str:
    """A docstring as running text: a line break where a sentence ends a line, a paragraph where it has one."""
    return re.sub(r"(?<![.:\n])\n(?!\n)", " ", inspect.getdoc(kind) or "")


if __name__ == "__main__":
    run_script(main)
