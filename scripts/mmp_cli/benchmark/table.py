"""The result of a benchmark: a table with a row per planner, and the reasons of errors and invalid instances."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from mmp_cli import output
from mmp_cli.output import printable

_NUMBERS = ("solved", "timeout", "exhausted", "error", "invalid", "median time", "mean time", "cost / straight lines")


def print_table(planners: Sequence[str], lines: Iterable[Mapping[str, Any]]) -> None:
    """Prints a table with a row for each planner, in the order of `planners`."""
    by_planner: dict[str, list[Mapping[str, Any]]] = {planner: [] for planner in planners}
    for line in lines:
        by_planner[line["planner"]].append(line)
    table = Table(box=None, pad_edge=False)
    table.add_column("planner")
    for name in _NUMBERS:
        table.add_column(name, justify="right")
    for planner, own in by_planner.items():
        table.add_row(Text(printable(planner)), *_cells(own))
    output.print_table(table)


def reasons(lines: Iterable[Mapping[str, Any]]) -> list[str]:
    """Returns a sentence per kind of error of each planner, then one per reason why instances are invalid.

    Each names the first instance and the number of further ones.
    """
    found: dict[tuple[str, str], dict[str, None]] = {}
    for line in sorted(lines, key=lambda line: line["status"] == "invalid"):
        if line["status"] in ("error", "invalid"):
            whose = line["planner"] if line["status"] == "error" else "invalid"
            found.setdefault((whose, str(line.get("message"))), {})[line["instance"]] = None
    return [
        f"{whose}: {message} ({next(iter(instances))}{f' and {len(instances) - 1} more' if len(instances) > 1 else ''})"
        for (whose, message), instances in found.items()
    ]


def _cells(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    counts = Counter(line["status"] for line in lines)
    valid = len(lines) - counts["invalid"]
    solved = [line for line in lines if line["status"] == "solved"]
    times = [t for line in solved if (t := line.get("planning_time_s")) is not None]
    ratios = [
        cost / bound
        for line in solved
        if (cost := line.get("cost_rad")) is not None and (bound := line.get("cost_lower_bound_rad"))
    ]
    return [
        f"{counts['solved']} of {valid}",
        *(str(counts[status] or "") for status in ("timeout", "exhausted", "error", "invalid")),
        f"{statistics.median(times):.3f} s" if times else "",
        f"{statistics.mean(times):.3f} s" if times else "",
        f"{statistics.median(ratios):.3f}" if ratios else "",
    ]
