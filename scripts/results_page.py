"""Keeps a measurement in docs/results. Usage: results_page.py FOLDER | --check

FOLDER is the output of `scripts/measure.py` or `scripts/reproduce_paper.sh`. The script keeps results (compressed),
settings and condition of every benchmark folder, and tables and figures of `cells` and `literal`. Tables of these, and
tables in the paper's form, go into docs/results/README.md, between `<!-- table: NAME -->` and `<!-- end of table -->`.
The lines of FOLDER/*.jsonl replace those of the same name in docs/results/figures.jsonl. With --check the
script writes nothing, and the exit code is 1 if the page is out of date.
"""

from __future__ import annotations

import gzip
import json
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks import LINES, PARTS, REPORTED, REPRODUCED
from claims import COLUMNS, claims_table, summary
from figure import commit
from measured import FIGURES, PLAIN, RESULTS, condition, folder_figures, median_load, read_figures
from paper_tables import fast_track_table, figure_five_table, pair_table, save, save_figures, table_one
from planner_tables import as_table
from quoted import quoted
from study_tables import heat_map_links, long_table, save_heat_maps, steps_table, verdict
from trade_off import trade_off_figure
from written_pages import bring_up_to_date, checking_parser, filled

from mmp_cli.machine import machine
from mmp_cli.main import run_script
from mmp_cli.reporting.formatting import NOTHING
from mmp_env.errors import MmpError

PAGE = RESULTS / "README.md"
_SHOWN = {
    "cells": ("Cells", "Errors"),
    "literal": ("Cells", "Errors", "Success, nodes, time, makespan and cost", "Fast track"),
}
"""Headings of table.md whose tables the page shows."""
_LEFT_OUT = ("literal/cactus-",)
"""Beginnings of figures that are too large to keep: one panel for each variant."""
_FORMS = {
    "table-one": table_one,
    "figure-five": figure_five_table,
    "fast-track": fast_track_table,
    "pairs": pair_table,
    "steps": steps_table,
    "long": long_table,
}
"""Tables that the page makes from the results of a folder: `<!-- table: FOLDER/NAME -->`."""
_TEXTS = {"verdict": verdict, "heat-maps": heat_map_links}
"""Other parts of the page, made and marked in the same way."""
_NOT_RUN = "Not run yet: `scripts/reproduce_paper.sh`, then `scripts/results_page.py FOLDER`.\n"


def main() -> None:
    """Keeps a measurement and writes the page, or reports that the page is out of date."""
    parser = checking_parser("results_page.py", __doc__)
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help="what to keep; not with --check")
    args = parser.parse()
    if args.check == (args.folder is not None):
        raise MmpError("give either FOLDER or --check")
    if not args.check:
        keep_all(args.folder, RESULTS)
        save_figures(RESULTS / "cells", RESULTS / "paper")
        save(trade_off_figure(read_figures()), RESULTS / "paper")
        if (RESULTS / "study").is_dir():
            save_heat_maps(RESULTS / "study", RESULTS / "paper")
    page = with_tables(PAGE.read_text(encoding="utf-8"), RESULTS)
    bring_up_to_date({PAGE: quoted(page, read_figures())}, check=args.check)


def keep_all(source: Path, results: Path) -> None:
    """Keeps each benchmark of a folder, and its lines of figures. Raises `MmpError` if it has neither."""
    folders = sorted(path.parent for path in source.glob("*/results.jsonl"))
    lines = [line for path in sorted(source.glob("*.jsonl")) for line in path.read_text(encoding="utf-8").splitlines()]
    if not folders and not lines:
        raise MmpError(f"{source} has no folder of `mmp bench` and no lines of figures; scripts/measure.py writes them")
    for folder in folders:
        keep(folder, results / folder.name)
    keep_lines(lines, results / FIGURES.name)


def keep(source: Path, target: Path) -> None:
    """Copies a benchmark folder, with its report if the page shows it; equal results give equal bytes."""
    if source.name in REPORTED and not (source / "table.md").is_file():
        raise MmpError(f"{source} has no table.md; `mmp report {source}` writes it")
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    kept = (".md", ".svg") if source.name in REPORTED else ()
    for path in sorted(source.iterdir()):
        left_out = f"{source.name}/{path.name}".startswith(_LEFT_OUT)
        if path.suffix in kept and not left_out:
            shutil.copyfile(path, target / path.name)
    settings = (source / "settings.json").read_text(encoding="utf-8")
    (target / "settings.json").write_text(_without_folders(settings), encoding="utf-8")
    content = (source / "results.jsonl").read_bytes()
    (target / "results.jsonl.gz").write_bytes(gzip.compress(content, mtime=0))
    notes = source.parent / "conditions"
    note = next((path for path in (notes / f"{source.name}.json", notes / "paper.json") if path.is_file()), None)
    words = note.read_text(encoding="utf-8") if note else json.dumps({"commit": commit(), "cpu": machine()}) + "\n"
    (target / "condition.json").write_text(words, encoding="utf-8")


def _without_folders(settings: str) -> str:
    """Returns the settings of a benchmark with the names of its source files, whose folders belong to one machine."""
    for given in json.loads(settings)["sources"]:
        settings = settings.replace(json.dumps(given), json.dumps(Path(given).name))
    return settings


def keep_lines(lines: list[str], path: Path) -> None:
    """Replaces lines by those of the same name, and drops figures that a kept benchmark has."""
    before = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    named = {json.loads(line)["name"]: line for line in [*before, *lines]}
    for folder in PLAIN:
        if (path.parent / folder / "results.jsonl.gz").is_file():
            measured = {name.rpartition("/")[0] for name in folder_figures(path.parent / folder)}
            stale = [name for name in named if name.rpartition("/")[0] in measured and not name.endswith("_published")]
            for name in stale:
                del named[name]
    path.write_text("".join(f"{line}\n" for line in named.values()), encoding="utf-8")


def with_tables(page: str, results: Path) -> str:
    """Returns the page with the tables of the benchmarks kept in `results`."""
    own = {"conditions": _conditions, "variants": _variants, "claims": _claims, "durations": _durations}
    return filled(page, lambda name: own[name](results) if name in own else _content(name, results))


def _variants(results: Path) -> str:
    """Returns the table of the options of each variant, as they were measured."""
    rows = ["| variant | planner | `--set` |", "|---|---|---|"]
    paths = [results / folder / "settings.json" for folder in ("literal", "decisions")]
    planners = [planner for path in paths if path.is_file() for planner in json.loads(path.read_text())["planners"]]
    for planner in planners:
        words = " ".join(f"{option}={_written(value)}" for option, value in planner["options"].items())
        rows.append(f"| `{planner['label']}` | `{planner['name']}` | {f'`{words}`' if words else ''} |")
    return "\n".join(dict.fromkeys(rows)) + "\n"


def _claims(results: Path) -> str:
    """Returns the table of the paper's claims, from the folders that judge them."""
    folders = [results / planners.folder / "results.jsonl.gz" for planners in COLUMNS.values()]
    if not all(path.is_file() for path in folders):
        return _NOT_RUN
    rows = list(claims_table(results))
    return as_table(iter(rows)) + summary(rows[1:])


def _durations(results: Path) -> str:
    """Returns the duration of each part, and the sum of those that `reproduce_paper.sh --instances` runs."""
    figures = read_figures(results)
    lines = {part: figures[f"duration_{part}"] for part in PARTS if f"duration_{part}" in figures}
    if not lines:
        return "Not measured yet: the next measurement writes the duration of each part.\n"
    rows = [["part", "duration", "runs at a time", "instances", "time limit"]]
    for part, line in lines.items():
        how = [str(line["workers"]), str(line["count"]), f"{line['time_limit_s']:g} s"]
        rows.append([f"`{part}`", f"{line['value'] / 60:.1f} min", *([NOTHING] * 3 if part in LINES else how)])
    total = ""
    if set(REPRODUCED) <= lines.keys():
        hours = sum(lines[part]["value"] for part in {*REPRODUCED, "circles"} & lines.keys()) / 3600
        total = f"\nAll parts of `scripts/reproduce_paper.sh` together took {hours:.1f} hours.\n"
    return as_table(iter(rows)) + total


def _written(value: object) -> str:
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)


def _conditions(results: Path) -> str:
    """Returns the table of the conditions of each kept benchmark."""
    rows = [
        "| folder | instances of a cell | time limit | runs at a time | load, median | commit | machine |",
        "|---|---|---|---|---|---|---|",
    ]
    for path in sorted(path.parent for path in results.glob("*/results.jsonl.gz")):
        settings, how = json.loads((path / "settings.json").read_text()), condition(path)
        load = median_load(path)
        workers, shown = how.get("workers") or "not noted", "not noted" if load is None else f"{load:.1f}"
        shown += ", real-time priority" if how.get("real_time") else ""
        where = [workers, shown, how.get("commit"), how.get("cpu")]
        cells = [f"`{path.name}`", settings["count"], f"{settings['time_limit_s']:g} s", *where]
        rows.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(rows) + "\n"


def _content(name: str, results: Path) -> str:
    folder, _, form = name.partition("/")
    if form:
        if not (results / folder / "results.jsonl.gz").is_file():
            return _NOT_RUN
        return _TEXTS[form](results / folder) if form in _TEXTS else as_table(_FORMS[form](results / folder))
    path = results / folder / "table.md"
    if not path.is_file():
        return _NOT_RUN
    return "\n\n".join(_chosen(path.read_text(encoding="utf-8"), _SHOWN[folder])) + "\n"


def _chosen(table: str, shown: Sequence[str]) -> Iterator[str]:
    """Yields facts and shown tables, with headings one level deeper."""
    for level, heading, body in _blocks(table):
        if level == 1:
            yield body
        elif heading in shown:
            yield f"{'#' * (level + 1)} {heading}\n\n{body}"


def _blocks(text: str) -> Iterator[tuple[int, str, str]]:
    """Yields level, heading and the text up to the next heading of any level."""
    parts = re.split(r"^(#+) (.*)$", text, flags=re.MULTILINE)[1:]
    for hashes, heading, body in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        yield len(hashes), heading, body.strip()


if __name__ == "__main__":
    run_script(main)
