"""Films of what `demo_work.py` and `demo_online.py` execute in MuJoCo, faster than it happens."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from demo_online import SHOWN_S, execution_of
from feeders_to_boxes import MOST_PARTS, feeders_to_boxes
from moving_box import CALLS_S, run

from gallery.film import Shot, write_webp
from mmp_env import CameraView, MmpError, find_cell
from mmp_env.sim.execution import ExecutionReport, execute_plan
from mmp_env.sim.rendering import Camera
from mmp_env.sim.schedule_execution import delayed_plan, simulation_of
from mmp_env.view.films import HOLD_S
from mmp_env.work.delays import actual_times
from mmp_planners import schedule

SPEED = 4.0
"""Simulated seconds in one second of a film."""
SIZE, FPS = (480, 300), 5.0
"""Size of a film [px] and its frames per second."""
ONLINE_S = 40.0
"""Simulated time of the film of online planning [s]."""
_CELL, _WITHIN_S = "ring-8", 0.05
_QUALITY = 38

Execute = Callable[[Callable[[], None]], ExecutionReport]
"""Executes a motion, and calls its argument every 40 ms of simulated time."""


def save_work(path: Path, parts: int = MOST_PARTS, size: tuple[int, int] = SIZE, fps: float = FPS) -> None:
    """Writes the film of arms that take parts from feeders to boxes. Raises `MmpError` if something touches."""
    planned = schedule(feeders_to_boxes(0, parts), time_limit=300.0).schedule
    if planned is None:
        raise MmpError("no schedule is found for the parts of the feeders")
    times = actual_times(planned, {})
    simulation = simulation_of(planned, times)
    plan = delayed_plan(planned, times, simulation.timestep_s)
    simulation.place(simulation.joined(plan.problem.start))
    camera = Camera(simulation, *size, fine=True, view=_view(3.7))
    _film(path, lambda show: execute_plan(simulation, plan, show), camera, fps)


def save_online(
    path: Path, seconds: float = ONLINE_S, size: tuple[int, int] = SIZE, fps: float = FPS, cell: str = _CELL
) -> None:
    """Writes the film of arms that work while a box is carried past. Raises `MmpError` if something touches."""
    found = find_cell(cell)
    *_, record = itertools.islice(run(found, _WITHIN_S, seed=0), round(seconds / CALLS_S))
    simulation, plan, carry_box = execution_of(found, record)
    camera = Camera(simulation, *size, fine=True, view=_view(3.9))

    def execute(show: Callable[[], None]) -> ExecutionReport:
        def carry_and_show() -> None:
            carry_box()
            show()

        return execute_plan(simulation, plan, carry_and_show)

    _film(path, execute, camera, fps)


def _view(distance_m: float) -> CameraView:
    """Returns a view of the middle of the table, obliquely from above."""
    return CameraView(azimuth=90.0, elevation=-50.0, distance=distance_m, lookat=np.array([0.0, 0.0, 0.15]))


def _film(path: Path, execute: Execute, camera: Camera, fps: float) -> None:
    """Writes the pictures of a camera during an execution."""
    every, count, shots = max(round(SPEED / fps / SHOWN_S), 1), 0, []

    def show() -> None:
        nonlocal count
        if count % every == 0:
            shots.append(Shot(picture=camera.show(), duration_ms=round(1e3 / fps)))
        count += 1

    report = execute(show)
    camera.close()
    if not report.reached or report.contacts:
        raise MmpError(f"{path.name}: the execution touches something or misses its goals")
    write_webp(path, [*shots[:-1], replace(shots[-1], duration_ms=round(1e3 * HOLD_S))], quality=_QUALITY, method=6)
