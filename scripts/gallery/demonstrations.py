"""Films of the paper's five demonstrations, each planned, retimed and executed on the mixed cell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mmp_planners
from gallery.film import Shot, write_webp
from mmp_env import MmpError, draw_problem, find_cell
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.retime import retime
from mmp_env.view.films import HOLD_S, frames

CELL, SEED = "mixed-4", 0
TASKS = ("crossing", "parallel", "pick", "place", "packing")
_SIZE, _FPS, _QUALITY = (640, 480), 5.0, 50
"""Size [px], frames per second and quality of the films; all five together stay below 1.5 MB."""


def save_demonstrations(folder: Path) -> None:
    """Writes `task-NAME.webp` for each task: the execution of its first instance, with transparent goals."""
    for task in TASKS:
        save_demonstration(task, folder / f"task-{task}.webp")


def save_demonstration(task: str, path: Path, size: tuple[int, int] = _SIZE, fps: float = _FPS) -> None:
    """Writes the film of one task. Raises `MmpError` if there is no plan or the execution misses its goals."""
    problem = draw_problem(find_cell(CELL), task, seed=SEED)
    result = mmp_planners.make("auto").plan(problem, seed=SEED, time_limit=60.0)
    if result.plan is None:
        raise MmpError(f"auto finds no plan for {task} on {CELL}, seed {SEED}")
    plan = retime(result.plan)
    env = MultiArmCellEnv(cell=problem.cell)
    report = env.execute(plan)
    env.close()
    if not report.reached or report.contacts:
        raise MmpError(f"{task} on {CELL}, seed {SEED}, is not executed as planned")
    shown = frames(plan, report, fps=fps, width=size[0], height=size[1], tool_paths=True)
    *shots, last = (Shot(picture=frame, duration_ms=round(1e3 / fps)) for frame in shown)
    write_webp(path, [*shots, replace(last, duration_ms=round(1e3 * HOLD_S))], quality=_QUALITY, method=6)
