"""Plans of `auto` over time, JSON lines with curves. Usage: bench_anytime.py [CELL...] [--count N] [--time-limit T]

For each cell or file, `auto` plans instances for T seconds and reports each better plan. A line has, at times on a
logarithmic scale, the share of instances with a plan, and the median cost as a multiple of the straight lines over all
instances, null while less than half of them have a plan. scripts/make_gallery.sh curves draws the lines.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

import numpy as np
from bench_portfolio import add_sources, read_sources
from figure import print_figure, rounded

from mmp_cli.arguments import Parser, seconds
from mmp_cli.main import run_script
from mmp_env.events import Event, SolutionFound
from mmp_env.model.problem import Problem
from mmp_planners import make

FIRST_S, PER_DECADE = 1e-3, 8
"""First time of a curve [s], and times per factor of ten."""


def main() -> None:
    """Prints the curves of each cell."""
    parser = Parser("bench_anytime.py", __doc__, argparse.RawDescriptionHelpFormatter)
    add_sources(parser, 20)
    parser.add_argument("--time-limit", type=seconds, default=5.0, metavar="T", help="time of each (default: 5 s)")
    args = parser.parse()
    for name, problems in read_sources(args):
        plans = [better_plans(problem, seed, args.time_limit) for seed, problem in enumerate(problems)]
        show(name, plans, args.time_limit)


def better_plans(problem: Problem, seed: int, limit: float) -> list[tuple[float, float]]:
    """Returns when `auto` found each better plan [s], and its cost as a multiple of the straight lines."""
    found: list[tuple[float, float]] = []

    def note(event: Event) -> None:
        if isinstance(event, SolutionFound):
            found.append((event.elapsed_s, event.cost_rad / bound))

    bound = problem.cost_lower_bound_rad
    make("auto").plan(problem, seed=seed, time_limit=limit, watch=note)
    return found


def show(name: str, plans: Sequence[Sequence[tuple[float, float]]], limit: float) -> None:
    """Prints the curves of one cell."""
    count = math.ceil(PER_DECADE * math.log10(limit / FIRST_S) - 1e-9)
    times = [FIRST_S * 10 ** (k / PER_DECADE) for k in range(count)] + [limit]
    costs = np.array([[min((c for at, c in found if at <= t), default=math.inf) for found in plans] for t in times])
    medians = np.quantile(costs, 0.5, axis=1, method="higher")
    print_figure(
        f"anytime_{name}",
        float(medians[-1]) if math.isfinite(medians[-1]) else 0.0,
        "x the straight lines",
        seconds=[rounded(t) for t in times],
        solved=[rounded(float(share)) for share in np.isfinite(costs).mean(axis=1)],
        cost=[rounded(float(m)) if math.isfinite(m) else None for m in medians],
        instances=len(plans),
    )


if __name__ == "__main__":
    run_script(main)
