"""How long `OnlinePlanner.replan` takes, and what it commits: JSON lines. Usage: bench_online.py [CELL...]

A box is carried through the cell while the arms work (moving_box.py). `late` counts calls that took more than 2 ms
longer than `within`, and `late_process` those whose processor time did: on a busy machine, calls that waited for the
processor are not among them.
"""

from __future__ import annotations

import argparse
import itertools

import numpy as np
from figure import print_figure, rounded
from moving_box import CALLS_S, least_clearances, run

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import find_cell

WITHIN_S = {"ring-4": 0.02, "ring-8": 0.05}
LATE_S = 0.002


def main() -> None:
    """Prints the 99th percentile of the duration of calls, on each cell."""
    parser = Parser("bench_online.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", nargs="*", default=list(WITHIN_S), metavar="CELL", help="default: ring-4 ring-8")
    parser.add_argument("--calls", type=whole, default=1000, metavar="N", help="calls on each cell (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="draws the way of the box and the goals")
    args = parser.parse()
    for name in args.cells:
        cell, within = find_cell(name), WITHIN_S.get(name, 0.05)
        record = next(itertools.islice(run(cell, within, args.seed), args.calls - 1, None))
        seconds = np.array([step.seconds for step in record.steps])
        moving, resting = least_clearances(cell, record)
        print_figure(
            f"replan_{name}",
            1e3 * float(np.percentile(seconds, 99)),
            "ms",
            median=rounded(1e3 * float(np.median(seconds))),
            largest=rounded(1e3 * float(seconds.max())),
            within=1e3 * within,
            late=int((seconds > within + LATE_S).sum()),
            late_process=int((np.array(record.process_s) > within + LATE_S).sum()),
            process_p99=rounded(1e3 * float(np.percentile(record.process_s, 99))),
            calls=args.calls,
            continuations=rounded(float(np.mean([step.kind == "continuation" for step in record.steps]))),
            reached=record.reached,
            simulated_s=rounded(CALLS_S * args.calls),
            unproved=record.unproved,
            clearance_moving_mm=rounded(1e3 * moving),
            clearance_resting_mm=rounded(1e3 * resting),
        )


if __name__ == "__main__":
    run_script(main)
