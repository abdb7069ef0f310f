"""Picks, packs and returns home: three plans, each from the end of the last one, checked and executed as one run."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import mmp_planners
from mmp_cli.arguments import Parser, check_spared, seconds, seed
from mmp_cli.main import run_script
from mmp_env import find_cell, make_problem
from mmp_env.check.episode import check_episode
from mmp_env.files.episode_file import Episode, episode_to_dict, save_episode
from mmp_env.files.writing import check_writable, left_alone
from mmp_env.retime import retime
from mmp_env.sim.episode_execution import execute_episode
from mmp_env.view.episode_film import save_episode_film
from mmp_env.view.films import check_film
from mmp_env.wording import counted
from mmp_planners import Planner
from mmp_tasks.sequence import Stage, stages


def main(arguments: Sequence[str] | None = None) -> int:
    """Draws, plans, checks, saves and executes. Returns 0 if every plan is valid and no contact occurs, 1 otherwise.

    Raises `MmpError` for misuse.
    """
    args = _parser().parse(arguments)
    planner = mmp_planners.make(args.planner)
    for option, path in (("--out", args.out), ("--video", args.video)):
        if path:
            check_spared(args.cell, option, path)
    if args.video:
        check_film(args.video)
    if args.out:
        check_writable(args.out)
    drawn = stages(find_cell(args.cell), np.random.default_rng(args.seed), args.task)
    episode = planned(f"{args.cell}-{args.task}-{args.seed}", drawn, planner, args.seed, args.time_limit)
    if episode is None:
        for sentence in left_alone(path for path in (args.out, args.video) if path):
            print(f"demo_packing.py: {sentence}", file=sys.stderr)
        return 1
    if args.retime:
        episode = replace(episode, plans=tuple(retime(plan) for plan in episode.plans))
        print(f"retimed: {episode.makespan_s:.2f} s of motion, each plan from rest to rest")
    if args.out:
        save_episode(episode, args.out)
        print(f"written to {args.out}")
    report = check_episode(episode_to_dict(episode))
    print(report)
    if not args.retime:
        print("warning: the plans are not retimed, no motor can follow their corners; leave out --no-retime")
    execution = execute_episode(episode)
    contacts = counted(execution.contacts, "contact") if execution.contacts else "no contact"
    reached = "all goals reached" if execution.reached else "NOT all goals reached"
    print(f"executed in {execution.duration_s:.2f} s of simulated time: {reached}, {contacts}")
    if args.video:
        save_episode_film(episode, args.video, execution)
        print(f"film: {args.video}")
    return 0 if report.valid and execution.reached and not execution.contacts else 1


def planned(name: str, drawn: Sequence[Stage], planner: Planner, seed: int, time_limit: float) -> Episode | None:
    """Plans each stage from the end of the last one. Returns None if a stage is not solved in time."""
    plans = []
    for stage in drawn:
        start = stage.start if not plans else {arm: q[-1] for arm, q in plans[-1].positions.items()}
        problem = make_problem(stage.cell, start, stage.goal, name=f"{name}/{stage.name}")
        began = time.perf_counter()
        result = planner.plan(problem, seed=seed, time_limit=time_limit)
        spent = time.perf_counter() - began
        print(f"{stage.name:8} {result.status} in {spent:.3f} s", end="")
        print(f", {result.plan.makespan_s:.2f} s of motion" if result.plan else "")
        if result.plan is None:
            return None
        plans.append(result.plan)
    return Episode(name=name, plans=tuple(plans))


def _parser() -> Parser:
    out = Parser("demo_packing.py", __doc__)
    out.add_argument("--cell", default="mixed-4", help="name or file; default: mixed-4")
    out.add_argument("--task", default="packing", choices=("place", "packing"), help="the second of the three")
    out.add_argument("--planner", default="auto", metavar="NAME", help="default: auto")
    out.add_argument("--seed", type=seed, default=0, metavar="N", help="of the draw and the planner; default: 0")
    out.add_argument("--time-limit", type=seconds, default=60.0, metavar="S", help="for each plan [s]; default: 60")
    help = "keep the plans as they are; by default they are smoothed, and keep acceleration and jerk limits"
    out.add_argument("--no-retime", action="store_false", dest="retime", help=help)
    out.add_argument("--video", metavar="FILE", help="a film of it all as it is executed: .mp4, .gif or .webp")
    out.add_argument("--out", metavar="FILE", help="write the episode (schema mmp-episode/1)")
    return out


if __name__ == "__main__":
    run_script(main)
