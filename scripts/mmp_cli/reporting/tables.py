"""The tables of one section, as text and numbers; the Markdown file and the page do the layout."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mmp_cli.reporting.formatting import NOTHING, mean_and_std, number, seconds, share
from mmp_cli.reporting.sections import PlannerRuns, Section
from mmp_cli.reporting.statistics import Spread, spread
from mmp_env.model.margins import KIND_WORDS, millimetres
from mmp_env.wording import counted


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """A table whose first column names the row. `text` says that the other columns are text; `note` explains them."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    text: bool = False


def overview(sections: Iterable[Section]) -> Table:
    """Returns the table of cells, instances and their difficulty."""
    rows = []
    for section in sections:
        roots = spread(section.root_conflicts)
        free = sum(count == 0 for count in section.root_conflicts)
        rows.append(
            [
                section.name,
                NOTHING if section.arms is None else str(section.arms),
                str(len(section.instances)),
                str(len(section.invalid)),
                str(len(section.solved_by_none)),
                f"{number(roots.median)} / {number(roots.p90)} / {number(roots.most)}" if roots else NOTHING,
                share(free, len(section.root_conflicts)) if roots else NOTHING,
            ]
        )
    head = ["cell", "arms", "instances", "invalid", "solved by no planner", "root conflicts", "none at the root"]
    note = (
        "Root conflicts say how hard the instances are: conflicts between the arms' first paths, in whole time steps "
        "(median / 90th percentile / most over the valid instances, each the mean of the planners that count them)."
    )
    return Table(title="Cells", head=head, rows=rows, note=note)


def main_table(section: Section) -> Table:
    """Returns the table like table I of the paper."""
    rows = [
        [
            run.label,
            share(len(run.solved), len(run.valid)),
            *(_mean(run.spread(field), len(run.solved)) for field in _MEASURES),
        ]
        for run in section.runs
    ]
    head = ["planner", "solved", "expanded nodes", "planning time [s]", "makespan [s]", "cost [rad]"]
    note = (
        "Mean ± standard deviation over what the planner itself has solved, so a planner that solves only the easy "
        "instances looks good here; success is over the valid instances."
    )
    note += _tree_note(rows, head.index("expanded nodes"))
    return Table(title="Success, nodes, time, makespan and cost", head=head, rows=rows, note=note)


_MEASURES = ("expanded_nodes", "planning_time_s", "makespan_s", "cost_rad")


def common_table(section: Section) -> Table | None:
    """Returns the same over the instances that every successful planner has solved, or None."""
    if not section.common:
        return None
    rows = [
        [run.label, *(_mean(run.spread(field, among=section.common), len(section.common)) for field in _MEASURES)]
        for run in section.successful
    ]
    head = ["planner", "expanded nodes", "planning time [s]", "makespan [s]", "cost [rad]"]
    left_out = [run.label for run in section.runs if not run.solved]
    note = f"Mean ± standard deviation over the {counted(len(section.common), 'instance')} solved by all of them."
    note += _tree_note(rows, head.index("expanded nodes"))
    if left_out:
        note += f" Left out, with nothing solved: {', '.join(left_out)}."
    return Table(title="Where all of them solve", head=head, rows=rows, note=note)


def time_table(section: Section) -> Table:
    """Returns the table of time quantiles, cost ratios, bounds and clearances."""
    rows = []
    for run in section.runs:
        time, ratio = run.spread("planning_time_s"), run.spread("cost_ratio")
        rows.append(
            [
                run.label,
                *(seconds(getattr(time, field)) if time else NOTHING for field in ("median", "p90", "most")),
                *(f"{getattr(ratio, field):.3f}" if ratio else NOTHING for field in ("mean", "median", "most")),
                _reported(run, "bound_met", run.solved),
                _reported(run, "deadline_hit", run.valid),
                _proved(run),
            ]
        )
    head = ["planner", "median", "90 %", "longest", "cost ratio, mean", "median", "largest"]
    head += ["bound met", "cut short", "clearance proved"]
    note = (
        "Planning time over the solved, certificate included. The cost ratio is the cost by the sum of the straight "
        "lines from start to goal, below which no plan can be. Bound met: of the solved. Cut short: stopped by the "
        "deadline, solved or not, of the valid. Clearance proved: by the checker, at every instant, the least over the "
        "solved plans: of each kind that a margin was asked for, or else of all kinds, an arm to itself among them."
    )
    if any(NOTHING in row for row in rows):
        note += f" {NOTHING}: the planner does not say, or has solved nothing."
    return Table(title="Time and cost in detail", head=head, rows=rows, note=note)


def fast_track_table(section: Section) -> Table | None:
    """Returns the table of fast-track tries and hits, or None if no planner has a fast track."""
    rows = []
    for run in section.runs:
        tries = sum(line.fast_track_tries or 0 for line in run.valid)
        hits = sum(line.fast_track_hits or 0 for line in run.valid)
        if tries:
            by_it = sum(bool(line.fast_track_hits) for line in run.solved)
            rows.append([run.label, str(int(tries)), share(int(hits), int(tries)), share(by_it, len(run.solved))])
    if not rows:
        return None
    note = "A hit is a modified node without any conflict; the last column counts solved instances with a hit."
    return Table(title="Fast track", head=["planner", "tries", "hits", "solved with a hit"], rows=rows, note=note)


def unsolved_table(section: Section) -> Table | None:
    """Returns the table of instances without a plan, or None."""
    rows = []
    for run in section.runs:
        for status in ("timeout", "exhausted", "error"):
            names = [_short(section, line.instance, line.seed) for line in run.unsolved if line.status == status]
            if names:
                rows.append([run.label, status, str(len(names)), ", ".join(names)])
    if not rows:
        return None
    note = "Exhausted: the constraints used up the search, which proves nothing about the instance."
    if section.solved_by_none:
        names = ", ".join(_short(section, name) for name in section.solved_by_none)
        note = f"Solved by no planner: {names}. {note}"
    return Table(title="Not solved", head=["planner", "status", "count", "instances"], rows=rows, note=note, text=True)


def invalid_table(section: Section) -> Table | None:
    """Returns the table of invalid instances, or None."""
    if not section.invalid:
        return None
    rows = [[_short(section, name), section.invalid[name] or NOTHING] for name in section.instances if name in
            section.invalid]  # fmt: skip
    note = (
        "Start or goal is itself in collision, out of limits or closer than a margin asked for: counted apart, "
        "neither solved nor failed."
    )
    return Table(title="Invalid", head=["instance", "why"], rows=rows, note=note, text=True)


def error_table(sections: Iterable[Section]) -> Table | None:
    """Returns the table of units that ended in an error, or None."""
    rows = [
        [run.label, line.instance, str(line.seed), line.message or "no message"]
        for section in sections
        for run in section.runs
        for line in run.errors
    ]
    head = ["planner", "instance", "seed", "message"]
    return Table(title="Errors", head=head, rows=rows, text=True) if rows else None


def section_tables(section: Section) -> list[Table]:
    """Returns the tables of a cell."""
    tables = [
        main_table(section),
        common_table(section),
        time_table(section),
        fast_track_table(section),
        unsolved_table(section),
        invalid_table(section),
    ]
    return [table for table in tables if table]


def measured(values: Spread | None) -> tuple[str, str, str]:
    """Returns median, 90th percentile and mean ± standard deviation of times [s]."""
    if values is None:
        return NOTHING, NOTHING, NOTHING
    return seconds(values.median), seconds(values.p90), mean_and_std(values)


def _mean(values: Spread | None, count: int) -> str:
    """Returns mean and standard deviation, with the number of values if some of `count` lines have none."""
    some = f" ({values.n} of {count})" if values and values.n < count else ""
    return mean_and_std(values) + some


def _proved(run: PlannerRuns) -> str:
    """Returns the clearance proved of each kind that was asked for, or else the least of all kinds."""
    proved = {kind: run.proved_m(kind) for kind in run.asked or (None,)}
    texts = {kind: f"{millimetres(clear)} mm" for kind, clear in proved.items() if clear is not None}
    words = (f"{text} {KIND_WORDS[kind]}" if kind else f"{text} of all kinds" for kind, text in texts.items())
    return ", ".join(words) or NOTHING


def _tree_note(rows: Iterable[Sequence[str]], column: int) -> str:
    """Returns the explanation of dashes and brackets in the column of nodes, if there are any."""
    cells, out = [row[column] for row in rows], ""
    if NOTHING in cells:
        out += f" {NOTHING}: the planner has grown no conflict tree, or has solved nothing."
    if any(cell.endswith(")") for cell in cells):
        out += " In brackets: on how many of the solved a conflict tree has grown; the mean is over these."
    return out


def _reported(run: PlannerRuns, field: str, lines: Sequence[object]) -> str:
    """Returns how many lines have the field set, or a dash if the planner does not report it."""
    values = [getattr(line, field) for line in lines]
    return NOTHING if all(value is None for value in values) else f"{sum(map(bool, values))} of {len(values)}"


def _short(section: Section, instance: str, seed: int | None = None) -> str:
    """Returns the instance without its cell, and with its seed if it was run with several."""
    name = instance.partition("/")[2] or instance
    return name if seed is None or len(section.seeds[instance]) < 2 else f"{name} (seed {seed})"
