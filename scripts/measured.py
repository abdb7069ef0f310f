"""Reads every measured figure by its name: the lines of docs/results/figures.jsonl, and the figures of kept benchmarks.

A kept benchmark is a folder of `mmp bench` under docs/results, its `results.jsonl` compressed. Its figures are named
FOLDER/CELL/PLANNER/WHAT and computed by the functions of `mmp report`; those of the folders in `PLAIN`, planners with
their default options, also CELL/PLANNER/WHAT.
"""

from __future__ import annotations

import gzip
import json
import shutil
import statistics
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from mmp_cli.reporting.results import read_results
from mmp_cli.reporting.sections import PlannerRuns, Section, commonly_solved, sections

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "docs" / "results"
FIGURES = RESULTS / "figures.jsonl"
PLAIN = ("cells", "others", "cbs-mp", "panda", "circles")
"""Folders of planners with default options; no planner is in two of them on the same cell."""
OURS = "apf-ecbs"
_FIELDS = {
    "planning_time": ("planning_time_s", "s"),
    "check_time": ("check_time_s", "s"),
    "expanded_nodes": ("expanded_nodes", "nodes"),
    "low_level_calls": ("low_level_calls", "calls"),
    "cost": ("cost_ratio", "x the straight lines"),
    "cost_rad": ("cost_rad", "rad"),
    "makespan": ("makespan_s", "s"),
}
"""Field of a result line, and unit, of each quantity; all over solved instances, as in `mmp report`."""

Row = dict[str, Any]
Figures = Mapping[str, Row]


def read_figures(results: Path = RESULTS) -> dict[str, Row]:
    """Returns the line of each figure by name; a kept benchmark has priority over `figures.jsonl`."""
    path = results / FIGURES.name
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    out = {row["name"]: row for row in map(json.loads, lines)}
    for folder in sorted(path.parent for path in results.glob("*/results.jsonl.gz")):
        of_folder = folder_figures(folder)
        out |= {f"{folder.name}/{name}": row for name, row in of_folder.items()}
        if folder.name in PLAIN:
            out |= of_folder
    return out


def kept_sections(folder: Path) -> tuple[Section, ...]:
    """Returns the cells of one kept benchmark."""
    with tempfile.TemporaryDirectory() as place:
        with gzip.open(folder / "results.jsonl.gz") as packed, open(Path(place) / "results.jsonl", "wb") as unpacked:
            shutil.copyfileobj(packed, unpacked)
        lines = read_results(Path(place)).lines
    order = [planner["label"] for planner in json.loads((folder / "settings.json").read_text())["planners"]]
    return sections(lines, order)


def folder_figures(folder: Path) -> dict[str, Row]:
    """Returns the lines of one kept benchmark by the names CELL/PLANNER/QUANTITY."""
    return {
        f"{section.name}/{name}": {"value": value, "unit": unit, **more, **condition(folder)}
        for section in kept_sections(folder)
        for name, value, unit, more in _section_figures(section)
    }


def condition(folder: Path) -> Row:
    """Returns machine, commit and workers of a kept benchmark."""
    return json.loads((folder / "condition.json").read_text(encoding="utf-8"))


def median_load(folder: Path) -> float | None:
    """Returns the median load of the machine over the runs of a kept benchmark; None for older results."""
    with gzip.open(folder / "results.jsonl.gz", "rt", encoding="utf-8") as lines:
        loads = [load for line in lines if (load := json.loads(line).get("load")) is not None]
    return statistics.median(loads) if loads else None


def _section_figures(section: Section) -> Iterator[tuple[str, float, str, Row]]:
    for run in section.runs:
        for name, value, unit, more in _run_figures(run, section):
            yield f"{run.label}/{name}", value, unit, more
    runs = {run.label: run for run in section.runs}
    ours = runs.pop(OURS, None)
    if ours:
        for run in runs.values():
            yield from _pair_figures(run, ours)


def _pair_figures(run: PlannerRuns, ours: PlannerRuns) -> Iterator[tuple[str, float, str, Row]]:
    """Yields the figures of a planner on the instances that `apf-ecbs` solves, too, with the ratio to it."""
    both = commonly_solved([run, ours])
    for what in ("expanded_nodes", "planning_time", "makespan", "cost_rad"):
        field, unit = _FIELDS[what]
        theirs, mine = (planner.spread(field, among=both) for planner in (run, ours))
        if not theirs or not mine:
            continue
        for part in ("mean", "median") if what == "planning_time" else ("mean",):
            # The mean may be 0 nodes. Then we divide by the mean that a single node would give.
            ratio = getattr(theirs, part) / max(getattr(mine, part), 1 / len(both) if what == "expanded_nodes" else 0)
            suffix = "" if part == "mean" else "_median"
            more = {"ratio": ratio, "ratio_to": OURS, "instances": len(both)}
            yield f"{run.label}/{what}{suffix}_where_both_solve", getattr(theirs, part), unit, more


def _run_figures(run: PlannerRuns, section: Section) -> Iterator[tuple[str, float, str, Row]]:
    failed = {line.instance: line.status for line in run.unsolved}
    yield "solved", len(run.solved), f"of {len(run.valid)}", {"failed": failed}
    yield "errors", len(run.errors), "runs", {}
    for what, (field, unit) in _FIELDS.items():
        for suffix, values in (("", run.spread(field)), ("_where_all_solve", _common(run, field, section))):
            if values:
                for part in ("mean", "median", "p90"):
                    yield f"{what}_{part}{suffix}", getattr(values, part), unit, {}
    tries, hits = (
        int(sum(getattr(line, f"fast_track_{what}") or 0 for line in run.valid)) for what in ("tries", "hits")
    )
    yield "fast_track_tries", tries, "tries", {}
    yield "fast_track_hits", hits, f"of {tries}", {}


def _common(run: PlannerRuns, field: str, section: Section) -> Any:
    return run.spread(field, among=section.common) if section.common and run.solved else None
