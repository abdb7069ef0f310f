"""Planning time with exact geometry relative to the sphere set `fine`: a JSON line per planner and source.

Usage: bench_exact.py [--instances FOLDER] [--count N]. The sources are rings of four and eight UR5e and Pandas, and the
files panda-circle-*.json of FOLDER. Only instances that both geometries can try count. Both run one after the other on
each instance, in turns, after a run of each that does not count. Times are of the processor, which other programs
disturb least; a run without a plan counts with the time limit.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from figure import print_figure
from jaxtyping import Float

import mmp_planners
from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import InvalidInstanceError, draw_problem, load_instances, make_problem, ring_cell
from mmp_env.model.problem import Problem

RINGS = [(arms, robot) for robot in ("ur5e", "panda") for arms in (4, 8)]
PLANNERS = ("apf-ecbs", "auto")
GEOMETRIES = ("fine", "exact")
TIME_LIMIT_S = 10.0


def main() -> None:
    """Prints a figure for each planner on each source."""
    parser = Parser("bench_exact.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=Path, metavar="FOLDER", help="folder of the instance files")
    parser.add_argument("--count", type=whole, default=20, metavar="N", help="instances of a source (default: 20)")
    parser.add_argument("--sources", nargs="+", metavar="NAME", help="only sources whose names begin so")
    args = parser.parse()
    for name, problems in sources(args.instances, args.count):
        if args.sources is None or name.startswith(tuple(args.sources)):
            pairs = list(problems)
            for planner in PLANNERS:
                compare(name, planner, pairs)


def sources(folder: Path | None, count: int) -> Iterator[tuple[str, Iterator[tuple[Problem, Problem]]]]:
    """Yields the name of each source and its problems, with fine spheres and with exact geometry."""
    for arms, robot in RINGS:
        cell = ring_cell(arms, robot, "fine")
        yield f"ring-{arms}-{robot}", in_both(draw_problem(cell, seed=seed) for seed in range(count))
    for path in sorted(folder.glob("panda-circle-*.json")) if folder else []:
        yield path.stem, in_both(published(path, count))


def published(path: Path, count: int) -> Iterator[Problem]:
    """Yields the first problems of a file that are free with fine spheres."""
    file = load_instances(path)
    file = replace(file, cell=replace(file.cell, spheres="fine"))
    for instance in file.instances[:count]:
        try:
            yield file.problem(instance)
        except InvalidInstanceError:
            continue


def in_both(problems: Iterator[Problem]) -> Iterator[tuple[Problem, Problem]]:
    """Yields each problem with fine spheres and with exact geometry, where that is free as well."""
    for problem in problems:
        try:
            cell = replace(problem.cell, spheres="exact")
            yield problem, make_problem(cell, problem.start, problem.goal, name=problem.name)
        except InvalidInstanceError:
            continue


def compare(source: str, planner: str, pairs: list[tuple[Problem, Problem]]) -> None:
    """Prints the median planning time with exact geometry, and its ratio to that with fine spheres."""
    if not pairs:
        return
    for problem in pairs[0]:  # the first run of a planner imports its modules
        planned(planner, problem, 0)
    times, solved = np.empty((len(pairs), 2)), np.zeros(2, dtype=int)
    for seed, pair in enumerate(pairs):
        for side in (0, 1) if seed % 2 else (1, 0):
            spent, found = planned(planner, pair[side], seed)
            times[seed, side] = spent
            solved[side] += found
    fine, exact = (statistics.median(column) for column in times.T)
    print_figure(
        f"{source}/{planner}/exact/time_median",
        exact,
        "s",
        ratio=exact / fine,
        ratio_to="fine",
        instances=len(pairs),
        ratio_of_pairs=geometric_mean(times[:, 1] / times[:, 0]),
        solved={name: int(count) for name, count in zip(GEOMETRIES, solved, strict=True)},
    )


def planned(planner: str, problem: Problem, seed: int) -> tuple[float, bool]:
    """Returns the processor time of planning [s], the time limit without a plan, and whether there is one."""
    _ = problem.cell.collision
    begin = time.process_time()
    found = mmp_planners.make(planner).plan(problem, seed=seed, time_limit=TIME_LIMIT_S).plan is not None
    return (time.process_time() - begin if found else TIME_LIMIT_S), found


def geometric_mean(ratios: Float[np.ndarray, "n"]) -> float:
    """Returns the geometric mean with four digits."""
    return round(float(np.exp(np.mean(np.log(ratios)))), 4)


if __name__ == "__main__":
    run_script(main)
