"""Mean cost relative to a published planner: a JSON line per planner. Usage: bench_published.py FOLDER CSV...

FOLDER is the folder of `mmp bench --out`; SOURCE.published.csv has the published results of one of its instance files.
Only instances that both have solved count.
"""

from __future__ import annotations

import argparse
import csv
import statistics
from pathlib import Path

from figure import print_figure

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_cli.reporting.results import read_results
from mmp_cli.reporting.sections import sections
from mmp_env import MmpError

PUBLISHED = "XECBS"
"""Published planner that costs are compared with."""


def main() -> None:
    """Prints the figures of all planners on all sources."""
    parser = Parser("bench_published.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="of `mmp bench --out`")
    parser.add_argument("tables", nargs="+", metavar="CSV", help="published results")
    args = parser.parse()
    published = {Path(file).name.partition(".")[0]: published_costs(file) for file in args.tables}
    for section in sections(read_results(args.folder).lines):
        theirs = published.get(section.name, {})
        for run in section.runs:
            costs = {line.instance.partition("/")[2]: line.cost_rad for line in run.solved}
            both = {name: cost for name, cost in costs.items() if name in theirs and cost is not None}
            if both:
                ours, other = statistics.mean(both.values()), statistics.mean(theirs[name] for name in both)
                more = {"ratio": ours / other, "ratio_to": f"published {PUBLISHED}", "instances": len(both)}
                print_figure(f"{section.name}/{run.label}/cost_mean_beside_published", ours, "rad", **more)


def published_costs(file: str) -> dict[str, float]:
    """Returns instance -> cost [rad] of the instances that the published planner solved. Raises `MmpError`."""
    try:
        with open(file, encoding="utf-8", newline="") as lines:
            rows = [row for row in csv.DictReader(lines) if row["planner"].upper() == PUBLISHED]
        return {row["instance"]: float(row["cost_rad"]) for row in rows if row["solved"] == "1"}
    except OSError as error:
        raise MmpError(f"{file} cannot be read: {error.strerror}") from None
    except (KeyError, ValueError) as error:
        raise MmpError(f"{file} has no such column or number: {error}") from None


if __name__ == "__main__":
    run_script(main)
