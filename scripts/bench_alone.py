"""Measures the shortest path of each arm alone, which estimates the least cost of a plan for all arms.

Usage: bench_alone.py FILE...   instance files; prints a JSON line for each. Plans every arm alone several times, among
obstacles and the other arms' bases, and keeps its shortest path: an upper estimate, because the planner samples.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
from bench_portfolio import valid_problems
from figure import print_figure

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env import core, load_instances
from mmp_env.model.problem import Problem
from mmp_planners.low_level import SiRrtStar
from mmp_planners.planning_context import PlanningContext

RUNS = 20
LOW_LEVEL = SiRrtStar(iterations=2000, shortcuts=1000)


def shortest(problem: Problem) -> float:
    """Returns the sum over the arms of the shortest path found [rad]."""
    lengths = np.full((RUNS, len(problem.cell.arms)), np.inf)
    for run in range(RUNS):
        context = PlanningContext(problem, 0.1, LOW_LEVEL, core.Clock(math.inf))
        context.reseed(run)
        for arm in range(len(problem.cell.arms)):
            path, _ = context.low_level(arm, (), run)
            lengths[run, arm] = math.inf if path is None else path.length
    return float(lengths.min(axis=0).sum())


def main() -> None:
    """Prints a figure for each file."""
    parser = Parser("bench_alone.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="FILE", help="instance file")
    for path in parser.parse().files:
        problems = valid_problems(load_instances(path))
        ratios = [shortest(problem) / problem.cost_lower_bound_rad for problem in problems]
        name = f"{Path(path).stem}/alone/cost_mean"
        print_figure(name, float(np.mean(ratios)), "x the straight lines", instances=len(ratios), most=max(ratios))


if __name__ == "__main__":
    run_script(main)
