"""Schedules of drawn jobs: planning, check, execution with random delays, and planted faults that the checker finds.

Usage: bench_work.py [--arms 4] [--jobs 24] [--packed 5] [--delays 1000] [--planted 200]. Each job moves above two
places near its arm, goes down and up again along straight lines, and waits below. Delays are up to 3 s for every
motion. Planted faults are in schedules of one job for each arm. `--packed` is the number of draws of the work of
demo_work.sh. Each schedule is compared with the same jobs in rounds, and with lower bounds of its makespan.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from feeders_to_boxes import feeders_to_boxes
from figure import print_figure
from work_faults import document_of, with_faults, with_object_faults

import mmp_env
import mmp_planners
from mmp_cli.arguments import Parser, whole, whole_or_zero
from mmp_cli.main import run_script
from mmp_env.check.schedule import check_schedule_document
from mmp_env.model.cell import Cell
from mmp_env.work.jobs import Jobs
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.schedule import Schedule

DELAY_S = 3.0
NEAR_M, FAR_M, HEIGHT_M, DOWN_M = 0.35, 0.6, 0.25, 0.08
"""Distances of places from the base of the arm, and their height; length of the lines."""
APART_M = 0.3
"""Least distance of a place from any base."""


def main() -> None:
    """Prints the figures."""
    parser = Parser("bench_work.py", __doc__)
    parser.add_argument("--arms", type=whole, default=4)
    parser.add_argument("--jobs", type=whole, default=24)
    parser.add_argument("--packed", type=whole_or_zero, default=5)
    parser.add_argument("--delays", type=whole_or_zero, default=1000)
    parser.add_argument("--planted", type=whole_or_zero, default=200)
    args = parser.parse()
    cell = mmp_env.ring_cell(args.arms)
    packed = [print_planned(feeders_to_boxes(seed), f"_{seed}") for seed in range(args.packed)]
    if packed:
        print_medians("work_feeders-to-boxes_4_median", packed)
    drawn = print_planned(drawn_jobs(cell, args.jobs, seed=0))
    if args.delays:
        print_delayed(drawn.schedule, args.delays)
    if args.planted:
        print_planted("work_planted", with_faults(planned(drawn_jobs(cell, args.arms, seed=1)), args.planted))
        print_planted("work_planted_objects", with_object_faults(planned(feeders_to_boxes(0, args.arms)), args.planted))


def drawn_jobs(cell: Cell, count: int, seed: int) -> Jobs:
    """Returns jobs for all arms in turns."""
    rng, jobs = np.random.default_rng(seed), []
    for k in range(count):
        arm, steps = cell.arms[k % len(cell.arms)], []
        for _ in range(2):
            x, y = _place(rng, cell, arm.T_world_base[:2, 3])
            pose = {"position": [x, y, HEIGHT_M], "quaternion": [0, 1, 0, 0], "free": "z"}
            lines = [{"line": [0, 0, -DOWN_M]}, {"wait": 0.2}, {"line": [0, 0, DOWN_M]}]
            steps += [{"move": {"pose": pose}}, *lines]
        jobs.append({"name": f"job{k}", "arm": arm.name, "steps": steps})
    data = {"schema": "mmp-jobs/1", "name": f"drawn-{count}", "cell": cell.name, "jobs": jobs}
    return jobs_from_dict(data, "drawn jobs")


def planned(jobs: Jobs) -> Schedule:
    """Returns a schedule of jobs. Raises `MmpError` if there is none."""
    result = mmp_planners.schedule(jobs)
    if result.schedule is None:
        raise mmp_env.MmpError(result.message)
    return result.schedule


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """A schedule, its planning time [s], and its makespan relative to those of `print_rounds`."""

    schedule: Schedule
    planning_s: float
    to_rounds: float
    to_shortest_rounds: float


def print_planned(jobs: Jobs, suffix: str = "") -> Measured:
    """Prints and returns the figures of planning and of the check. `suffix`: of the names of figures."""
    began = time.process_time()
    schedule = planned(jobs)
    planning_s = time.process_time() - began
    document = document_of(schedule)
    began = time.process_time()
    report = check_schedule_document(document)
    name = f"work_{jobs.name}_{len(jobs.cell.arms)}{suffix}"
    print_figure(f"{name}_planning_s", planning_s, "s")
    print_figure(f"{name}_check_s", time.process_time() - began, "s")
    print_figure(f"{name}_makespan_s", schedule.makespan_s, "s")
    print_figure(f"{name}_planning_share", planning_s / schedule.makespan_s, "of the makespan")
    for bound, words in ((schedule.busiest_s, "busiest arm"), (schedule.balanced_s, "work shared equally")):
        ratio = schedule.makespan_s / bound
        print_figure(f"{name}_{words.replace(' ', '_')}_s", bound, "s", ratio=ratio, ratio_to=f"makespan / {words}")
    print_figure(f"{name}_order_pairs", len(schedule.order), "pairs")
    print_figure(f"{name}_valid", float(report.valid), "schedules")
    execution = mmp_env.execute_schedule(schedule)
    without_contact = float(execution.reached and not execution.contacts)
    print_figure(f"{name}_executed_without_contact", without_contact, "schedules", seconds=execution.duration_s)
    to_rounds, to_shortest = print_rounds(schedule, name)
    return Measured(schedule=schedule, planning_s=planning_s, to_rounds=to_rounds, to_shortest_rounds=to_shortest)


def print_rounds(schedule: Schedule, name: str) -> tuple[float, float]:
    """Prints makespans of the same jobs, arms and limits in rounds. Returns the ratios of the makespan to them.

    The second makespan is a lower bound: as if in each round all arms began together and none waited for another.
    Without a schedule in rounds it says why, and the ratios are NaN.
    """
    try:
        result = mmp_planners.schedule(schedule.assigned, rounds=True)
    except mmp_env.MmpError as error:
        print(f"{name}: no schedule in rounds: {error}", file=sys.stderr)
        return np.nan, np.nan
    if result.schedule is None:
        print(f"{name}: no schedule in rounds: {result.message}", file=sys.stderr)
        return np.nan, np.nan
    out = []
    for words, in_rounds_s in (
        ("in_rounds", result.schedule.makespan_s),
        ("in_shortest_rounds", shortest_rounds_s(result.schedule, result.stats["round_begins_s"])),
    ):
        out.append(schedule.makespan_s / in_rounds_s)
        ratio_to = f"own time / {words[3:].replace('_', ' ')}"
        print_figure(f"{name}_{words}_s", in_rounds_s, "s", ratio=out[-1], ratio_to=ratio_to)
    return out[0], out[1]


def shortest_rounds_s(schedule: Schedule, begins_s: Sequence[float]) -> float:
    """Returns the sum over all rounds of the longest time that the steps of an arm take in the round [s]."""
    total, ends_s = 0.0, [*begins_s[1:], np.inf]
    for begin, end in zip(begins_s, ends_s, strict=True):
        inside = [event for event in schedule.events if begin - 1e-6 <= event.begin_s < end - 1e-6]
        busy = [sum(e.end_s - e.begin_s for e in inside if e.arm == arm) for arm in schedule.trajectories]
        total += max(busy)
    return total


def print_medians(name: str, measured: Sequence[Measured]) -> None:
    """Prints the medians over several schedules."""
    shares = [each.planning_s / each.schedule.makespan_s for each in measured]
    print_figure(f"{name}_planning_share", float(np.median(shares)), "of the makespan")
    for words, ratios in (
        ("rounds", [each.to_rounds for each in measured]),
        ("shortest_rounds", [each.to_shortest_rounds for each in measured]),
    ):
        print_figure(f"{name}_own_time_to_{words}", float(np.median(ratios)), "of the makespan in rounds")


def print_delayed(schedule: Schedule, count: int) -> None:
    """Prints the figures of executions with random delays."""
    name = f"work_{schedule.jobs.name}_{len(schedule.trajectories)}_delayed"
    contacts, missed, closer, torque, duration = 0, 0, 0.0, 0.0, 0.0
    for seed in range(count):
        report = mmp_env.execute_schedule(schedule, delays=DELAY_S, seed=seed)
        contacts += bool(report.contacts)
        missed += not report.reached
        closer = max(closer, report.nearness.closer_m)
        torque = max(torque, *(load.share for load in report.loads.values()))
        duration = max(duration, report.duration_s)
    print_figure(f"{name}_patterns", count, "executions")
    print_figure(f"{name}_with_contact", contacts, "executions")
    print_figure(f"{name}_missed", missed, "executions")
    print_figure(f"{name}_closer_than_proved_mm", 1e3 * closer, "mm")
    print_figure(f"{name}_torque_share_max", torque, "of the rating")
    print_figure(f"{name}_longest_s", duration, "s")


def print_planted(name: str, faulty: Sequence[Mapping[str, Any]]) -> None:
    """Prints how many schedules with planted faults the checker refutes."""
    found = sum(not check_schedule_document(each).valid for each in faulty)
    print_figure(name, len(faulty), "faults")
    print_figure(f"{name}_found", found, "faults")


def _place(rng: np.random.Generator, cell: Cell, base: np.ndarray) -> tuple[float, float]:
    """Returns a place near the base of an arm that is not near another base [m]."""
    while True:
        angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(NEAR_M, FAR_M)
        place = base + distance * np.array([np.cos(angle), np.sin(angle)])
        if min(np.linalg.norm(place - arm.T_world_base[:2, 3]) for arm in cell.arms) > APART_M:
            return round(float(place[0]), 3), round(float(place[1]), 3)


if __name__ == "__main__":
    run_script(main)
