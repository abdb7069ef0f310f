"""Our results and published ones, on the instances that both have and that are valid with our geometry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mmp_cli.reporting.formatting import NOTHING, mean_and_std, number, share
from mmp_cli.reporting.published import Published, Row, unknown
from mmp_cli.reporting.sections import Section
from mmp_cli.reporting.statistics import Spread, spread
from mmp_cli.reporting.tables import Table, measured
from mmp_env.wording import counted

ROUNDING_RAD = 0.01
"""Largest amount [rad] by which rounding can put a published cost below the straight lines."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One planner, ours or published: times and costs of the solved units, of `tried` ones."""

    label: str
    published: bool
    tried: int
    times: Mapping[tuple[str, int], float]
    costs: Mapping[tuple[str, int], float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """One published file and one section."""

    source: str
    note: str
    instances: tuple[str, ...]
    left_out: Mapping[str, str]
    """Instance of the file -> reason why it is not compared."""
    entries: tuple[Entry, ...]


def compare(published: Published, section: Section, matched: Mapping[str, Mapping[str, Sequence[Row]]]) -> Comparison:
    """Compares both sides on the common instances; for `matched` see `published.match`."""
    rows = matched[section.name]
    left_out = {name: why for name in rows if (why := _why_not(section, name, rows[name]))}
    names = tuple(name for name in rows if name not in left_out)
    left_out |= dict.fromkeys(unknown(published, matched), "not in these results")
    entries = [_ours(section, index, frozenset(names)) for index in range(len(section.runs))]
    # A published result counts for every seed of ours.
    for planner in published.planners:
        rows_of_planner = {(name, seed): row for name in names for row in rows[name] if row.planner == planner
                for seed in section.seeds[name]}  # fmt: skip
        solved = {unit: row for unit, row in rows_of_planner.items() if row.solved}
        times = {unit: row.planning_time_s for unit, row in solved.items() if row.planning_time_s is not None}
        costs = {unit: row.cost_rad for unit, row in solved.items() if row.cost_rad is not None}
        entries.append(Entry(label=planner, published=True, tried=len(rows_of_planner), times=times, costs=costs))
    return Comparison(
        source=published.name, note=published.note, instances=names, left_out=left_out, entries=tuple(entries)
    )


def _why_not(section: Section, name: str, rows: Sequence[Row]) -> str | None:
    """Returns why a common instance cannot be compared, or None."""
    if name in section.invalid:
        return f"invalid here: {section.invalid[name] or 'the results do not say why'}"
    bound = section.lower_bounds.get(name)
    for row in rows:
        if bound is not None and row.cost_rad is not None and row.cost_rad < bound - ROUNDING_RAD:
            least = f"the straight lines from start to goal, {number(bound)} rad, below which no plan can be"
            return f"the published cost of {row.planner}, {number(row.cost_rad)} rad, is less than {least}"
    return None


def _ours(section: Section, index: int, names: frozenset[str]) -> Entry:
    run = section.runs[index]
    solved = {unit: line for unit, line in run.by_problem.items() if line.instance in names}
    return Entry(
        label=run.label,
        published=False,
        tried=sum(line.instance in names for line in run.valid),
        times={unit: x.planning_time_s for unit, x in solved.items() if x.planning_time_s is not None},
        costs={unit: x.cost_rad for unit, x in solved.items() if x.cost_rad is not None},
    )


def comparison_tables(comparison: Comparison) -> list[Table]:
    """Returns the table of solved instances, times and costs, and the table of costs where both sides solve."""
    rows = []
    for entry in comparison.entries:
        costs: Spread | None = spread(entry.costs.values())
        figures = share(len(entry.times), entry.tried), *measured(spread(entry.times.values())), mean_and_std(costs)
        rows.append([entry.label, "published" if entry.published else "ours", *figures])
    note = (
        f"Published: {comparison.source}, {comparison.note}. Times are of different machines. On the "
        f"{counted(len(comparison.instances), 'instance')} that both have and that are valid here; times and costs "
        "over what the planner itself has solved."
    )
    if comparison.left_out:
        reasons = (f"{name.partition('/')[2] or name} ({why})" for name, why in comparison.left_out.items())
        note += f" Left out: {'; '.join(reasons)}."
    head = ["planner", "whose", "solved", "median time", "90 %", "mean time [s]", "mean cost [rad]"]
    first = Table(title=f"Beside {comparison.source}", head=head, rows=rows, note=note)
    return [first, _cost_table(comparison)]


def _cost_table(comparison: Comparison) -> Table:
    ours = [entry for entry in comparison.entries if not entry.published]
    theirs = [entry for entry in comparison.entries if entry.published]
    rows = [[entry.label, *(_cost(mine, entry) for mine in ours)] for entry in theirs]
    note = "Mean of ours / mean of theirs [rad] = ratio, over the instances that both solve (their number in brackets)."
    head = ["published", *(entry.label for entry in ours)]
    return Table(title=f"Cost beside {comparison.source}", head=head, rows=rows, note=note)


def _cost(mine: Entry, theirs: Entry) -> str:
    common = [unit for unit in mine.costs if unit in theirs.costs]
    if not common:
        return NOTHING
    means = [sum(entry.costs[unit] for unit in common) / len(common) for entry in (mine, theirs)]
    ratio = f" = {means[0] / means[1]:.2f}" if means[1] > 0 else ""
    return f"{number(means[0])} / {number(means[1])}{ratio} ({len(common)})"
