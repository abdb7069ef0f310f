"""Runs the native core under a sanitizer, see scripts/sanitize.sh. Usage: under_sanitizers.py WHAT

plans: one instance with every planner. threads: two threads that plan at once. loaded SYMBOL...: ends with an error
unless the loaded core is beside this file, in a checkout or a copy of it, and has these symbols of a sanitizer.
"""

from __future__ import annotations

import itertools
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from mmp_env import core, draw_problem, find_cell
from mmp_env.model.problem import Problem
from mmp_planners import make, names

TIME_LIMIT_S = 20.0


def loaded() -> None:
    """Ends with an error unless the loaded core has the symbols of a sanitizer that the command line names."""
    file = Path(core.load_variant(core.preferred_variant()).__file__ or "").resolve()
    if not file.is_relative_to(Path(__file__).resolve().parents[2]):
        sys.exit(f"the loaded core is another one: {file}")
    missing = [symbol for symbol in sys.argv[2:] if symbol.encode() not in file.read_bytes()]
    if missing:
        sys.exit(f"{file} has no {', '.join(missing)}: it is not instrumented")
    print(f"{file.name} has {', '.join(sys.argv[2:])}", flush=True)


def plans() -> None:
    """Plans one instance with every planner."""
    problem = draw_problem(find_cell("ring-4"), "crossing", 3)
    for name in names():
        print(f"{name}: {make(name).plan(problem, time_limit=TIME_LIMIT_S).status}", flush=True)


def threads() -> None:
    """Plans in two threads at once, in one cell and in two."""
    cell = find_cell("ring-4")
    for cells in ((cell, cell), (cell, find_cell("ring-6"))):
        problems = [draw_problem(each, "crossing", k) for k, each in enumerate(cells)]
        with ThreadPoolExecutor(len(problems)) as pool:
            for name in names():
                ends = pool.map(_plan, [name] * len(problems), problems)
                print(f"{name}: {', '.join(itertools.chain(*ends))}", flush=True)


def _plan(name: str, problem: Problem) -> list[str]:
    """Returns how the planner ended with two seeds."""
    return [str(make(name).plan(problem, seed=seed, time_limit=TIME_LIMIT_S).status) for seed in range(2)]


if __name__ == "__main__":
    {"loaded": loaded, "plans": plans, "threads": threads}[sys.argv[1]]()
