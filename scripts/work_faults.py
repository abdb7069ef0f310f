"""Faults to plant in schedules, each of them really wrong, for a test of the checker."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.model.collision import CollisionModel
from mmp_env.model.robot import EXACT
from mmp_env.work.order import numbered
from mmp_env.work.schedule import OrderPair, Schedule
from mmp_env.work.schedule_file import schedule_to_dict

SAMPLES = 100
"""Number of samples of a motion that tell whether a pair of the order is needed."""
OBJECT_FAULTS = ("elsewhere", "left out", "another object", "no event", "another pose", "too high")
FAULTS = ("missing pair", "early pair", "jump", "late line", "no event", "contact")
_TRIES, _STEP_S = 200, 0.1
"""Largest number of delays that are tried for a contact; time between the instants that are tested for one [s]."""


def with_faults(schedule: Schedule, count: int) -> list[dict[str, Any]]:
    """Returns contents of schedule files, each with a fault of motions or of the order, of all kinds in turns."""
    document, rng = document_of(schedule), np.random.default_rng(0)
    needed = [k for k, pair in enumerate(schedule.order) if is_needed(schedule, pair)]
    out = []
    for k in range(count):
        faulty, fault = copy.deepcopy(document), FAULTS[k % len(FAULTS)]
        if fault == "contact":
            plant_contact(faulty, schedule, rng)
        else:
            plant(faulty, fault, needed, rng)
        out.append(faulty)
    return out


def with_object_faults(schedule: Schedule, count: int) -> list[dict[str, Any]]:
    """Returns contents of schedule files, each with a fault of objects, of all kinds in turns."""
    document, rng = document_of(schedule), np.random.default_rng(0)
    out = []
    for k in range(count):
        out.append(copy.deepcopy(document))
        plant_object(out[-1], OBJECT_FAULTS[k % len(OBJECT_FAULTS)], rng)
    return out


def document_of(schedule: Schedule) -> dict[str, Any]:
    """Returns the content of the file of a schedule."""
    return json.loads(json.dumps(schedule_to_dict(schedule)))


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


def plant_object(document: dict[str, Any], fault: str, rng: np.random.Generator) -> None:
    """Plants a fault of objects in the content of a schedule file."""
    events = [event for event in document["events"] if event["kind"] in ("grasp", "release")]
    event = events[int(rng.integers(len(events)))]
    objects = document["objects"]
    solid = objects[int(rng.integers(len(objects)))]
    if fault == "elsewhere":
        solid["position"][int(rng.integers(2))] += float(rng.choice([-1, 1]) * rng.uniform(0.002, 0.05))
    elif fault == "left out":
        objects.remove(solid)
    elif fault == "another object":
        event["object"] = next(each["name"] for each in objects if each["name"] != event["object"])
    elif fault == "no event":
        document["events"].remove(event)
    elif fault == "another pose":
        event["pose"]["position"][int(rng.integers(3))] += float(rng.choice([-1, 1]) * rng.uniform(0.001, 0.05))
    else:
        index = int(np.argmax(solid["size"]))
        solid["size"][index] += float(rng.uniform(0.005, 0.05))


def _event(document: Mapping[str, Any], rng: np.random.Generator, kind: str) -> dict[str, Any]:
    events = [event for event in document["events"] if event["kind"] == kind and event["until"] > event["time"]]
    return events[int(rng.integers(len(events)))]


def plant_contact(document: dict[str, Any], schedule: Schedule, rng: np.random.Generator) -> None:
    """Delays an arm from an event on so that it touches another arm. Raises `MmpError` if no such delay is found."""
    collision = replace(schedule.problem.cell, spheres=EXACT).collision
    for _ in range(_TRIES):
        event = schedule.events[int(rng.integers(len(schedule.events)))]
        periods = int(rng.integers(5, 500))
        delay_s = periods * float(document["period_s"])
        if touches(schedule, collision, event.arm, event.begin_s, delay_s):
            break
    else:
        raise MmpError("no delay of an arm causes a contact")
    track = document["trajectories"][event.arm]
    times, at = track["times"], int(np.searchsorted(track["times"], event.begin_s + 1e-6))
    q = schedule.trajectories[event.arm].at(np.array([event.begin_s]))[0].tolist()
    rest = [round(event.begin_s, 9), round(event.begin_s + delay_s, 9)]
    before = int(np.searchsorted(times, event.begin_s - 1e-6))
    track["times"] = [*times[:before], *rest, *(round(time + delay_s, 9) for time in times[at:])]
    track["positions"] = [*track["positions"][:before], q, q, *track["positions"][at:]]
    for each in document["events"]:
        if each["arm"] == event.arm and each["time"] >= event.begin_s - 1e-6:
            each["time"], each["until"] = each["time"] + delay_s, each["until"] + delay_s


def touches(schedule: Schedule, collision: CollisionModel, arm: str, begin_s: float, delay_s: float) -> bool:
    """Returns whether an arm touches another at sampled instants if it is delayed from a time on."""
    times = np.arange(begin_s, schedule.makespan_s + delay_s, _STEP_S)
    own = schedule.trajectories[arm].at(np.maximum(times - delay_s, begin_s))
    others = (name for name in schedule.trajectories if name != arm)
    clear = [collision.pair_clearance(arm, own, name, schedule.trajectories[name].at(times)) for name in others]
    return bool(np.min(clear) < 0.0)
