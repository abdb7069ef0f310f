"""Memory of one process over many plans and episodes: two JSON lines. Usage: soak.py [--plans N] [--episodes N]

It ends with 1 if the memory grows by more than 1 %.

Plans are of all planners in turn, on instances of `--cell`; episodes are of its environment, with random actions. Half
as many of each come before as warm-up: growth is of the resident memory from its end to the end of all. Before both,
Python collects its garbage and the allocator gives back the pages that it keeps for later; `with_slack` is the growth
with these pages, and `blocks` that of the memory blocks which Python has handed out, both in percent.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import os
import sys
from collections.abc import Callable
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


def main() -> int:
    """Prints the growth of the resident memory over the plans, and over the episodes. Returns 1 if it is too large."""
    parser = Parser("soak.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cell", default="ring-4", metavar="CELL", help="cell of both parts (default: ring-4)")
    parser.add_argument("--plans", type=whole, default=10_000, metavar="N", help="plans (default: 10000)")
    parser.add_argument("--episodes", type=whole, default=1000, metavar="N", help="episodes (default: 1000)")
    parser.add_argument("--time-limit", type=seconds, default=0.1, metavar="S", help="of a plan [s] (default: 0.1)")
    args = parser.parse()
    cell, planners = find_cell(args.cell), names()

    def plan(number: int) -> None:
        problem = draw_problem(cell, seed=number)
        make(planners[number % len(planners)]).plan(problem, seed=number, time_limit=args.time_limit)

    growths = [show("soak_plans", "plans", plan, args.plans)]
    with gymnasium.make("MultiArmCell", cell=cell) as env:
        actions = np.random.default_rng(0)

        def episode(number: int) -> None:
            env.reset(seed=number)
            ended = False
            while not ended:
                action = actions.uniform(-1.0, 1.0, env.action_space.shape)
                _, _, terminated, truncated, _ = env.step(action.astype(np.float32))
                ended = terminated or truncated

        growths.append(show("soak_episodes", "episodes", episode, args.episodes))
    return int(max(growths) > MOST)


def show(name: str, what: str, once: Callable[[int], None], count: int) -> float:
    """Repeats a call. Prints and returns how much the resident memory grew after the warm-up, in percent."""
    warm_up = max(count // 2, 1)
    for number in range(warm_up):
        once(number)
    kept_before, before, blocks = resident_bytes(), resident_bytes(without_slack=True), sys.getallocatedblocks()
    for number in range(warm_up, warm_up + count):
        once(number)
    kept_after, after = resident_bytes(), resident_bytes(without_slack=True)
    figures = {"before_mb": round(before / MEGABYTE, 1), "after_mb": round(after / MEGABYTE, 1), what: count}
    figures["with_slack"] = rounded(100.0 * (kept_after / kept_before - 1.0))
    figures["blocks"] = rounded(100.0 * (sys.getallocatedblocks() / blocks - 1.0))
    growth = 100.0 * (after / before - 1.0)
    print_figure(f"{name}_growth", growth, "%", **figures)
    return growth


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
