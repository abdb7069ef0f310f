"""Size of a recording and the time that it adds to planning: a JSON line each. Usage: bench_rerun.py [ID]

It uses, for each planner, the one of the first twenty instances whose search expands closest to fifty nodes. The time
added is that with the watcher, including its file, minus that without. The import of rerun is a figure of its own.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import gymnasium
from figure import print_figure, timed

import mmp_env  # noqa: F401 - registers the environments
from mmp_cli.arguments import Parser, environment_id
from mmp_cli.main import run_script
from mmp_env.model.problem import Problem
from mmp_env.view.rerun import RerunWatcher, require
from mmp_planners import make

SOURCE, PLANNERS = "MultiArmCell-8", ("ecbs", "apf-ecbs", "auto")
SEEDS, NODES, REPEATS, LIMIT_S = 20, 50, 5, 20.0


def main() -> None:
    """Prints the figures of one environment."""
    parser = Parser("bench_rerun.py", __doc__)
    parser.add_argument("id", nargs="?", type=environment_id, default=SOURCE, help=f"default: {SOURCE}")
    source = parser.parse().id
    begin = time.perf_counter()
    require()
    print_figure("rerun_import", time.perf_counter() - begin, "s")
    env = gymnasium.make(source)
    problems = [draw(env, seed) for seed in range(SEEDS)]
    for planner in PLANNERS:
        seed, expanded = nearest(problems, planner)
        problem = problems[seed]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "search.rrd"
            watched = timed(lambda: record(problem, planner, seed, path), REPEATS)  # noqa: B023 - called at once
            size = path.stat().st_size
        alone = timed(lambda: make(planner).plan(problem, seed=seed, time_limit=LIMIT_S), REPEATS)  # noqa: B023
        more = {"planner": planner, "instance": f"{source}/{seed}", "expanded_nodes": expanded}
        print_figure(f"recording_size/{planner}", size / 1e6, "MB", **more)
        print_figure(
            f"recording_time_added/{planner}", watched[0] - alone[0], "s", **more, planning_s=round(alone[0], 3)
        )


def draw(env: gymnasium.Env, seed: int) -> Problem:
    """Returns the instance of a seed."""
    env.reset(seed=seed)
    return env.unwrapped.problem  # pyright: ignore[reportAttributeAccessIssue]


def nearest(problems: list[Problem], planner: str) -> tuple[int, int]:
    """Returns the seed whose search expands closest to `NODES` nodes, and its number of expanded nodes."""
    counts = []
    for seed, problem in enumerate(problems):
        result = make(planner).plan(problem, seed=seed, time_limit=LIMIT_S)
        counts.append(result.stats["expanded_nodes"] or 0)
    seed = min(range(len(counts)), key=lambda k: abs(counts[k] - NODES))
    return seed, counts[seed]


def record(problem: Problem, planner: str, seed: int, path: Path) -> None:
    """Plans and writes the recording."""
    with RerunWatcher(problem, path) as watcher:
        watcher.show_plan(make(planner).plan(problem, seed=seed, time_limit=LIMIT_S, watch=watcher).plan)


if __name__ == "__main__":
    run_script(main)
