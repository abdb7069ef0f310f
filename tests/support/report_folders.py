"""Benchmark folders made by hand for the tests of `mmp report`, and a reader of its table.md."""

from __future__ import annotations

import json
import re


def line(instance, planner, status="solved", **more):
    """Returns a line of results.jsonl with all required fields."""
    cell, _, name = instance.partition("/")
    out = {"instance": instance, "planner": planner, "seed": int(name) if name.isdigit() else 0, "status": status}
    out |= {"cell": cell, "arms": 4, "planning_time_s": 1.0, "version": "0.1.0", "machine": "a test, 1 core"}
    if status == "solved":
        out |= {"cost_rad": 12.0, "cost_lower_bound_rad": 10.0, "makespan_s": 3.0, "expanded_nodes": 1}
    return out | more


def settings(*labels, sources=("ring",), count=5, **more):
    planners = [{"label": label, "name": "ecbs", "options": {}} for label in labels]
    out = {"schema": "mmp-bench/1", "sources": list(sources), "planners": planners, "count": count, "seed": 0}
    return out | {"time_limit_s": 10.0, "task": "reach", "margin": 0.002, "version": "0.1.0"} | more


def folder_of(path, lines, set_to=None, end="\n"):
    """Returns a benchmark folder."""
    path.mkdir(exist_ok=True)
    (path / "results.jsonl").write_text("\n".join(json.dumps(x) for x in lines) + end, encoding="utf-8")
    if set_to is not None:
        (path / "settings.json").write_text(json.dumps(set_to))
    return path


def row(text, table, label):
    """Returns the cells of a row of table.md, by the heads of the columns."""
    block = text.split(f"# {table}\n\n")[1].split("\n\n")[0].splitlines()
    head, *rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", x)[1:-1]] for x in block if "---" not in x]
    return dict(zip(head, next(cells for cells in rows if cells[0] == label), strict=True))
