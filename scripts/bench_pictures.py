"""Times of pictures, films, trees and recordings: a JSON line each. Usage: bench_pictures.py [CELL...]

For instance 0 of task `reach` in each cell: a picture of one moment of the plan of `auto`, fine and not, with the start
of OpenGL; a frame of its film, fine and not, as the mean over frames after the first; the drawing of the conflict tree
of `apf-ecbs`; and the time that a recording of that search takes beside planning, with its size. All but the frames are
the shortest of three runs.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from contextlib import closing
from functools import partial
from pathlib import Path

from figure import print_figure, timed

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env import Plan, Problem, SearchTree, draw_problem, find_cell, save_picture
from mmp_env.errors import MmpError
from mmp_env.view.films import frames
from mmp_env.view.rerun import RerunWatcher
from mmp_planners import make

CELLS = ("ring-8", "line-48")
REPEATS, LIMIT_S = 3, 10.0
FPS, FRAMES = 10, 20
WIDTH, HEIGHT = 640, 360


def main() -> None:
    """Prints the figures of each cell."""
    parser = Parser("bench_pictures.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", nargs="*", metavar="CELL", help=f"default: {' '.join(CELLS)}")
    for name in parser.parse().cells or CELLS:
        with tempfile.TemporaryDirectory() as folder:
            measure(name, draw_problem(find_cell(name), seed=0), Path(folder))


def measure(name: str, problem: Problem, folder: Path) -> None:
    """Prints the figures of one instance."""
    plan = make("auto").plan(problem, seed=0, time_limit=LIMIT_S).plan
    if plan is None:
        raise MmpError(f"auto finds no plan for {problem.name} in {LIMIT_S:g} s")
    arms, path = len(problem.cell.arms), folder / "picture.png"
    for kind, fine in (("picture", False), ("fine_picture", True)):
        shot = partial(save_picture, plan, path, moments=["middle"], fine=fine, width=WIDTH, height=HEIGHT)
        times = timed(shot, REPEATS)
        print_figure(f"{kind}_{name}", times[0], "s", arms=arms)
    for kind, fine in (("film_frame", False), ("fine_film_frame", True)):
        print_figure(f"{kind}_{name}", frame_seconds(plan, fine), "s", arms=arms, frames=FRAMES)
    tree = SearchTree()
    planner = make("apf-ecbs")
    planner.plan(problem, seed=0, time_limit=LIMIT_S, watch=tree)
    times = timed(lambda: tree.save(folder / "tree.svg"), REPEATS)
    print_figure(f"tree_drawing_{name}", times[0], "s", nodes=len(tree.nodes), size_mb=megabytes(folder / "tree.svg"))
    recording = folder / "search.rrd"
    watched = timed(lambda: record(problem, recording), REPEATS)
    alone = timed(lambda: planner.plan(problem, seed=0, time_limit=LIMIT_S), REPEATS)
    print_figure(f"recording_{name}", watched[0] - alone[0], "s", nodes=len(tree.nodes), size_mb=megabytes(recording))


def frame_seconds(plan: Plan, fine: bool) -> float:
    """Returns the mean time of a frame [s] after the first, which starts OpenGL."""
    with closing(frames(plan, fps=FPS, fine=fine, width=WIDTH, height=HEIGHT)) as shown:
        next(shown)
        begin = time.perf_counter()
        for _ in itertools.islice(shown, FRAMES):
            pass
        return (time.perf_counter() - begin) / FRAMES


def record(problem: Problem, path: Path) -> None:
    """Plans and writes the recording."""
    with RerunWatcher(problem, path) as watcher:
        watcher.show_plan(make("apf-ecbs").plan(problem, seed=0, time_limit=LIMIT_S, watch=watcher).plan)


def megabytes(path: Path) -> float:
    """Returns the size of a file [MB]."""
    return round(path.stat().st_size / 1e6, 2)


if __name__ == "__main__":
    run_script(main)
