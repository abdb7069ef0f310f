"""Runs the native core under a sanitizer, see scripts/sanitize.sh. Usage: under_sanitizers.py plans|threads"""

from __future__ import annotations

import sys
import threading

from mmp_env import draw_problem, find_cell
from mmp_env.model.problem import Problem
from mmp_planners import make, names

TIME_LIMIT_S = 20.0


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
        for name in names():
            running = [threading.Thread(target=_plan, args=(name, problem)) for problem in problems]
            for thread in running:
                thread.start()
            for thread in running:
                thread.join()
            print(f"{name}: done", flush=True)


def _plan(name: str, problem: Problem) -> None:
    for seed in range(2):
        make(name).plan(problem, seed=seed, time_limit=TIME_LIMIT_S)


if __name__ == "__main__":
    {"plans": plans, "threads": threads}[sys.argv[1]]()
