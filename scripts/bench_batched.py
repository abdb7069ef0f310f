"""Steps of eight environments in threads, relative to one after the other: a JSON line. Usage: bench_batched.py [ID]

Both are vector environments of Gymnasium with the same actions, and run in turns. It ends with 1 if threads are less
than 1.7 times as fast.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time

import gymnasium
import numpy as np
from figure import print_figure, rounded

from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env import batched_env

ID, COUNT = "MultiArmCell-4", 8
LEAST_RATIO = 1.7
"""Smallest ratio of the speeds, on two cores."""


def main() -> int:
    """Prints the ratio of the medians over the rounds. Returns 1 if it is below `LEAST_RATIO`."""
    parser = Parser("bench_batched.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("id", nargs="?", default=ID, metavar="ID", help=f"default: {ID}")
    parser.add_argument("--steps", type=whole, default=100, metavar="N", help="steps in a round (default: 100)")
    parser.add_argument("--rounds", type=whole, default=7, metavar="N", help="rounds of each kind (default: 7)")
    args = parser.parse()
    kinds = {
        "one after the other": gymnasium.make_vec(f"mmp_env:{args.id}", num_envs=COUNT, vectorization_mode="sync"),
        "threads": batched_env(args.id, COUNT),
    }
    rates: dict[str, list[float]] = {kind: [] for kind in kinds}
    for seed in range(args.rounds):
        for kind, envs in kinds.items():
            envs.reset(seed=seed)
            actions = np.random.default_rng(seed).uniform(-0.2, 0.2, (args.steps, *envs.action_space.shape))  # pyright: ignore
            begin = time.perf_counter()
            for action in actions.astype(np.float32):
                envs.step(action)
            rates[kind].append(COUNT * args.steps / (time.perf_counter() - begin))
    for envs in kinds.values():
        envs.close()
    sync, parallel = (statistics.median(rates[kind]) for kind in kinds)
    print_figure(
        f"batched_{args.id}",
        parallel,
        "steps/s",
        ratio=parallel / sync,
        ratio_to="the same environments one after the other",
        one_after_the_other=rounded(sync),
        environments=COUNT,
    )
    return judged(parallel / sync)


def judged(ratio: float) -> int:
    """Returns 0 for a ratio from `LEAST_RATIO` on, else 1 after a sentence."""
    if ratio >= LEAST_RATIO:
        return 0
    print(f"threads are {ratio:.2f} times as fast as one after the other; required: {LEAST_RATIO}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    run_script(main)
