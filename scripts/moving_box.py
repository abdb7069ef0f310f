"""A box that is carried through a cell while the arms work: the world of bench_online.py and demo_online.py.

The box is the cart of `mmp_env.sim.cart`. The arms are told every 0.1 s where it is. They get new goals when they have
reached theirs, and sooner if they need too long.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from mmp_env import OnlinePlanner, OnlineStep, draw_problem
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.sim.cart import Cart, CartOptions

CALLS_S = 0.1
"""Time between two calls of `replan` [s]."""
SPEED, EDGE_M = 0.3, 0.15
"""Largest speed of the box [m/s], and its edges."""
_STEP_S = 0.01
_LONGEST_S = 30.0
"""Time after which the arms get other goals [s]."""
_GOALS = 40


@dataclass
class Record:
    """What happened: the answers, the processor time of each [s], and every 10 ms the configurations and the box.

    `committed()` gives what was committed by the last answer.
    """

    steps: list[OnlineStep] = field(default_factory=list)
    process_s: list[float] = field(default_factory=list)
    q: list[Float[np.ndarray, "n dofs"]] = field(default_factory=list)
    box: list[Float[np.ndarray, "3"]] = field(default_factory=list)
    reached: int = 0
    unproved: int = 0
    committed: Callable[[], Plan] | None = None


def run(cell: Cell, within: float, seed: int) -> Iterator[Record]:
    """Yields the record so far after every call of `replan`, without an end."""
    rng, record, now = np.random.default_rng(seed), Record(), [0.0]
    draws = [draw_problem(cell, "crossing", seed=_GOALS * seed + k) for k in range(_GOALS)]
    box = Cart(cell, CartOptions(edge=EDGE_M, speed=SPEED))
    box.begin(rng)
    online = OnlinePlanner(cell, draws[0].start, seed=seed, clock=lambda: now[0])
    online.add_obstacle(box.obstacle("box"), speed=SPEED)
    goal, since = 0, 0.0
    for call in itertools.count():
        record.unproved += not online.move_obstacle("box", box.place, speed=SPEED)
        began = time.process_time()
        step = online.replan(draws[goal].goal, within=within)
        record.process_s.append(time.process_time() - began)
        record.steps.append(step)
        record.committed = online.committed
        times = now[0] + _STEP_S * np.arange(round(CALLS_S / _STEP_S))
        rows = online.positions(times)
        record.q.append(np.hstack([rows[name] for name in cell.arm_names]))
        spheres = [cell.collision.spheres(name, rows[name]) for name in cell.arm_names]
        centers, radii = np.concatenate([c for c, _ in spheres], axis=1), np.concatenate([r for _, r in spheres])
        for k in range(len(times)):
            record.box.append(box.place)
            box.advance(centers[k], radii, _STEP_S)
        yield record
        now[0] = CALLS_S * (call + 1)
        arrived = step.arrives and step.ends_s <= now[0]
        record.reached += arrived
        if arrived or now[0] - since > _LONGEST_S:
            goal, since = (goal + 1) % _GOALS, now[0]


def least_clearances(cell: Cell, record: Record) -> tuple[float, float]:
    """Returns the least clearance [m] of the box from the spheres of arms that move, and of arms that stand."""
    q, places = np.concatenate(record.q), np.array(record.box)
    least = {True: np.inf, False: np.inf}
    first = 0
    for arm in cell.arms:
        rows = np.ascontiguousarray(q[:, first : first + arm.dof])
        moves = np.append((np.diff(rows, axis=0) != 0).any(axis=1), False)
        first += arm.dof
        for begin in range(0, len(rows), 1000):
            some = slice(begin, begin + 1000)
            centers, radii = cell.collision.spheres(arm.name, rows[some])
            links = ~cell.collision.is_base(arm.name)
            out = np.maximum(np.abs(centers[:, links] - places[some, None]) - EDGE_M / 2, 0.0)
            apart = (np.linalg.norm(out, axis=2) - radii[links]).min(axis=1)
            for moving in (True, False):
                least[moving] = min(least[moving], float(apart[moves[some] == moving].min(initial=np.inf)))
    return least[True], least[False]
