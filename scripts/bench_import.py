"""Time of `import mmp_env, mmp_planners` after MuJoCo and Gymnasium: a JSON line. Usage: bench_import.py"""

from __future__ import annotations

import statistics
import subprocess
import sys

from figure import print_figure, rounded

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script

PROCESSES = 15
THEIRS, OURS = "mujoco, gymnasium", "mmp_env, mmp_planners"
PROGRAM = f"""
import time
begin = time.perf_counter()
import {THEIRS}
between = time.perf_counter()
import {OURS}
print(between - begin, time.perf_counter() - between)
"""


def main() -> None:
    """Prints the best time of several processes, the median, and the ratio to the time of MuJoCo and Gymnasium."""
    Parser("bench_import.py", __doc__).parse()
    times = [measured() for _ in range(PROCESSES + 1)][1:]  # the first one may still compile
    theirs, ours = ([row[k] for row in times] for k in (0, 1))
    print_figure(
        "import",
        min(ours),
        "s",
        ratio=min(ours) / min(theirs),
        ratio_to=f"import {THEIRS}",
        median=rounded(statistics.median(ours)),
    )


def measured() -> list[float]:
    """Returns the import times [s] in a new process: theirs, and ours after it."""
    out = subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True)
    return [float(number) for number in out.stdout.split()]


if __name__ == "__main__":
    run_script(main)
