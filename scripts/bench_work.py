"""Schedules of drawn jobs: planning, check, execution with random delays, and planted faults that the checker finds.

Usage: bench_work.py [--arms 4] [--jobs 24] [--delays 1000] [--planted 200]. Each job moves above two places near its
arm, goes down and up again along straight lines, and waits below. Delays are up to 3 s for every motion. Planted
faults are in a schedule of one job for each arm.
"""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from figure import print_figure

import mmp_env
import mmp_planners
from mmp_cli.arguments import Parser, whole
from mmp_cli.main import run_script
from mmp_env.check.schedule import check_schedule_document
from mmp_env.model.cell import Cell
from mmp_env.work.jobs import Jobs
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.order import numbered
from mmp_env.work.schedule import OrderPair, Schedule
from mmp_env.work.schedule_file import schedule_to_dict

DELAY_S = 3.0
NEAR_M, FAR_M, HEIGHT_M, DOWN_M = 0.35, 0.6, 0.25, 0.08
"""Distances of places from the base of the arm, and their height; length of the lines."""
APART_M = 0.3
"""Least distance of a place from any base."""
SAMPLES = 100
"""Number of samples of a motion that tell whether a pair of the order is needed."""
FAULTS = ("missing pair", "early pair", "jump", "late line", "no event")


def main() -> None:
    """Prints the figures."""
    parser = Parser("bench_work.py", __doc__)
    parser.add_argument("--arms", type=whole, default=4)
    parser.add_argument("--jobs", type=whole, default=24)
    parser.add_argument("--delays", type=whole, default=1000)
    parser.add_argument("--planted", type=whole, default=200)
    args = parser.parse()
    cell = mmp_env.ring_cell(args.arms)
    schedule = print_planned(drawn_jobs(cell, args.jobs, seed=0))
    print_delayed(schedule, args.delays)
    print_planted(planned(drawn_jobs(cell, args.arms, seed=1)), args.planted)


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


def print_planned(jobs: Jobs) -> Schedule:
    """Prints the figures of planning and of the check, and returns the schedule."""
    began = time.process_time()
    schedule = planned(jobs)
    planning_s = time.process_time() - began
    document = json.loads(json.dumps(schedule_to_dict(schedule)))
    began = time.process_time()
    report = check_schedule_document(document)
    name = f"work_{len(jobs.cell.arms)}_{len(jobs.jobs)}"
    busy_s = sum(event.end_s - event.begin_s for event in schedule.events)
    print_figure(f"{name}_planning_s", planning_s, "s")
    print_figure(f"{name}_check_s", time.process_time() - began, "s")
    print_figure(f"{name}_makespan_s", schedule.makespan_s, "s")
    print_figure(f"{name}_planning_share", planning_s / schedule.makespan_s, "of the makespan")
    print_figure(f"{name}_busy_share", busy_s / schedule.makespan_s / len(jobs.cell.arms), "of the makespan")
    print_figure(f"{name}_in_rounds_s", rounds_s(schedule), "s")
    print_figure(f"{name}_order_pairs", len(schedule.order), "pairs")
    print_figure(f"{name}_valid", float(report.valid), "schedules")
    return schedule


def rounds_s(schedule: Schedule) -> float:
    """Returns the time of the same steps in rounds [s]: in each round every arm does its next step, without conflicts.

    A round takes as long as its longest step, so no synchronous execution of these motions is shorter.
    """
    lasting: dict[str, list[float]] = {}
    for event in schedule.events:
        if event.job is not None:
            lasting.setdefault(event.arm, []).append(event.end_s - event.begin_s)
    count = max(map(len, lasting.values()))
    return sum(max(each[k] for each in lasting.values() if k < len(each)) for k in range(count))


def print_delayed(schedule: Schedule, count: int) -> None:
    """Prints the figures of executions with random delays."""
    name = f"work_{len(schedule.trajectories)}_{len(schedule.jobs.jobs)}_delayed"
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


def print_planted(schedule: Schedule, count: int) -> None:
    """Prints how many planted faults the checker finds."""
    document, rng = json.loads(json.dumps(schedule_to_dict(schedule))), np.random.default_rng(0)
    needed = [k for k, pair in enumerate(schedule.order) if is_needed(schedule, pair)]
    found = 0
    for k in range(count):
        faulty = copy.deepcopy(document)
        plant(faulty, FAULTS[k % len(FAULTS)], needed, rng)
        found += not check_schedule_document(faulty).valid
    print_figure("work_planted", count, "faults")
    print_figure("work_planted_found", found, "faults")


def is_needed(schedule: Schedule, pair: OrderPair) -> bool:
    """Returns whether samples of two motions meet if they do not keep their order in the second half of the point."""
    rows = []
    for (arm, number), window in ((pair.first, (0.5 * pair.past_s, pair.past_s)), (pair.second, None)):
        event = numbered(schedule.events)[arm, number]
        first, last = window if window is not None else (0.0, event.end_s - event.begin_s)
        rows.append(schedule.trajectories[arm].at(event.begin_s + np.linspace(first, last, SAMPLES)))
    collision = schedule.problem.cell.collision
    mine, other = np.repeat(rows[0], SAMPLES, axis=0), np.tile(rows[1], (SAMPLES, 1))
    clear = collision.pair_clearance(pair.first[0], mine, pair.second[0], other)
    return bool(clear.min() < schedule.problem.margins.arms)


def plant(document: dict[str, Any], fault: str, needed: Sequence[int], rng: np.random.Generator) -> None:
    """Plants a fault in the content of a schedule file, whose `needed` pairs of motions meet without their order."""
    if fault in ("missing pair", "early pair"):
        number = int(rng.choice(needed))
        if fault == "early pair":
            document["order_past_s"][number] *= float(rng.uniform(0.0, 0.5))
        else:
            del document["order"][number], document["order_past_s"][number]
        return
    event = _event(document, rng, "line" if fault == "late line" else "move")
    if fault == "no event":
        document["events"].remove(event)
    elif fault == "late line":
        event["time"] += 0.1
    else:
        track = document["trajectories"][event["arm"]]
        row = int(np.searchsorted(track["times"], event["until"] - 1e-6))
        track["positions"][row][int(rng.integers(len(track["positions"][row])))] += float(rng.uniform(0.005, 0.05))


def _event(document: Mapping[str, Any], rng: np.random.Generator, kind: str) -> dict[str, Any]:
    events = [event for event in document["events"] if event["kind"] == kind and event["until"] > event["time"]]
    return events[int(rng.integers(len(events)))]


def _place(rng: np.random.Generator, cell: Cell, base: np.ndarray) -> tuple[float, float]:
    """Returns a place near the base of an arm that is not near another base [m]."""
    while True:
        angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(NEAR_M, FAR_M)
        place = base + distance * np.array([np.cos(angle), np.sin(angle)])
        if min(np.linalg.norm(place - arm.T_world_base[:2, 3]) for arm in cell.arms) > APART_M:
            return round(float(place[0]), 3), round(float(place[1]), 3)


if __name__ == "__main__":
    run_script(main)
