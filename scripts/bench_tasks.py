"""Processor time of drawing an instance: a JSON line per cell and task. Usage: bench_tasks.py

The first draw of a process does not count: it imports mink and makes the table of configurations.
"""

from __future__ import annotations

import itertools
import time
from statistics import median

from figure import print_figure, rounded

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import draw_problem, find_cell
from mmp_env.model.cell import Cell

TASKS = ("crossing", "parallel", "pick", "place", "packing")
CELLS = ("mixed-4", "ring-4", "ring-4-panda", "ring-6", "ring-8")
REACHED = ("ring-8", "shelf-8-panda", "line-16", "line-64")
"""Cells of task `reach`, which benchmarks draw."""


def main() -> None:
    """Prints median and largest time of the seeds 0, 1, ..."""
    parser = Parser("bench_tasks.py", __doc__)
    parser.add_argument("--count", type=whole, default=50, metavar="N", help="seeds (default: 50)")
    count = parser.parse().count
    for name, task in [*itertools.product(CELLS, TASKS), *((name, "reach") for name in REACHED)]:
        cell = find_cell(name)
        draw_problem(cell, task, seed=count)
        times = [spent(cell, task, seed) for seed in range(count)]
        print_figure(f"{name}/{task}/draw", median(times), "s", max=rounded(max(times)), seeds=count)


def spent(cell: Cell, task: str, seed: int) -> float:
    """Returns the processor time of one draw [s]."""
    begin = time.process_time()
    draw_problem(cell, task, seed=seed)
    return time.process_time() - begin


if __name__ == "__main__":
    run_script(main)
