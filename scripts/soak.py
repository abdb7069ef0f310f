"""Memory of one process over many plans and episodes: two JSON lines. Usage: soak.py [--plans N] [--episodes N]

It ends with 1 if the memory grows by more than 1 %, or a planner makes no plan.

Plans are of all planners in turn, on instances of `--cell`; episodes are of its environment, with random actions. A run
that finds no plan in time does not count, so there are more `runs` than plans; `solved` has the plans of each planner.
A warm-up of half as many plans and episodes comes first: growth is of the resident memory, from the end of the warm-up
to the end of the run. Before both, Python collects its garbage and the allocator gives back the pages that it keeps for
later; `with_slack` is the growth with these pages, and `blocks` that of the memory blocks which Python has handed out,
both in percent.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import os
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import gymnasium
import numpy as np
from figure import print_figure, rounded

from mmp_cli.arguments import Parser, seconds, whole
from mmp_cli.main import run_script
from mmp_env import draw_problem, find_cell
from mmp_planners import make, names

MEGABYTE = 1e6
MOST = 1.0
"""Largest growth [%]."""
MOST_RUNS = 4
"""Number of runs for each plan or episode that is wanted, after which no more are tried."""


def main() -> int:
    """Prints the growth of the resident memory over the plans, and over the episodes.

    Returns 1 if it is too large, if a planner made no plan, or if there are too few plans.
    """
    parser = Parser("soak.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cell", default="ring-4", metavar="CELL", help="cell of both parts (default: ring-4)")
    parser.add_argument("--plans", type=whole, default=10_000, metavar="N", help="plans (default: 10000)")
    parser.add_argument("--episodes", type=whole, default=1000, metavar="N", help="episodes (default: 1000)")
    parser.add_argument("--time-limit", type=seconds, default=0.1, metavar="S", help="of a plan [s] (default: 0.1)")
    args = parser.parse()
    cell, planners = find_cell(args.cell), names()

    def plan(number: int) -> str | None:
        problem, planner = draw_problem(cell, seed=number), planners[number % len(planners)]
        result = make(planner).plan(problem, seed=number, time_limit=args.time_limit)
        return None if result.plan is None else planner

    growth, solved = show("soak_plans", "plans", plan, args.plans, planners)
    growths, failed = [growth], False
    for planner in planners:
        if not solved[planner]:
            print(f"{planner} made no plan in {args.time_limit:g} s", file=sys.stderr)
            failed = True
    if solved.total() < args.plans:
        print(f"only {solved.total()} of {args.plans} plans were made", file=sys.stderr)
        failed = True
    with gymnasium.make("MultiArmCell", cell=cell) as env:
        actions = np.random.default_rng(0)

        def episode(number: int) -> str:
            env.reset(seed=number)
            ended = False
            while not ended:
                action = actions.uniform(-1.0, 1.0, env.action_space.shape)
                _, _, terminated, truncated, _ = env.step(action.astype(np.float32))
                ended = terminated or truncated
            return "MultiArmCell"

        growths.append(show("soak_episodes", "episodes", episode, args.episodes)[0])
    return int(failed or max(growths) > MOST)


def show(
    name: str, what: str, once: Callable[[int], str | None], count: int, makers: Sequence[str] = ()
) -> tuple[float, Counter[str]]:
    """Repeats a call, and prints how much the resident memory grew after the warm-up, in percent.

    Args:
        name: beginning of the name of the figure.
        what: plural of what a call makes.
        once: gets the number of the call, and returns who made something; None if it made nothing.
        count: how many are made after the warm-up.
        makers: who makes something. The figure has the number of each.

    Returns:
        The growth [%], and how many each made after the warm-up.
    """
    first, _ = repeated(once, 0, max(count // 2, 1))
    kept_before, before, blocks = resident_bytes(), resident_bytes(without_slack=True), sys.getallocatedblocks()
    end, made = repeated(once, first, count)
    kept_after, after = resident_bytes(), resident_bytes(without_slack=True)
    figures = {"before_mb": round(before / MEGABYTE, 1), "after_mb": round(after / MEGABYTE, 1), what: made.total()}
    solved = {"runs": end - first, "solved": {maker: made[maker] for maker in makers}} if makers else {}
    figures["with_slack"] = rounded(100.0 * (kept_after / kept_before - 1.0))
    figures["blocks"] = rounded(100.0 * (sys.getallocatedblocks() / blocks - 1.0))
    growth = 100.0 * (after / before - 1.0)
    print_figure(f"{name}_growth", growth, "%", **figures, **solved)
    return growth, made


def repeated(once: Callable[[int], str | None], first: int, count: int) -> tuple[int, Counter[str]]:
    """Repeats a call, with numbers from `first` on, until it has made `count` things, or `MOST_RUNS` times as often.

    Returns the next number, and how many each maker made.
    """
    number, made = first, Counter[str]()
    while made.total() < count and number < first + MOST_RUNS * count:
        maker = once(number)
        if maker is not None:
            made[maker] += 1
        number += 1
    return number, made


def resident_bytes(*, without_slack: bool = False) -> int:
    """Returns the resident memory of this process [bytes], without objects that only wait for collection.

    Args:
        without_slack: whether the allocator of the C library gives back the pages that it keeps; only glibc can.
    """
    gc.collect()
    if without_slack and hasattr(ctypes.CDLL(None), "malloc_trim"):
        ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    run_script(main)
