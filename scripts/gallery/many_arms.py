"""The film of 48 arms in two rows, and the plan in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import mmp_planners
from gallery.film import Shot, write_webp
from mmp_env import CameraView, MmpError, draw_problem, find_cell
from mmp_env.view.films import HOLD_S, frames

CELL, SEED = "line-48", 0
_UNTIL = 1.05
"""Cost, as a multiple of the straight lines, that ends the search."""
_SIZE, _ROWS = (1000, 400), np.s_[125:285]
"""Size of the rendered pictures [px], and the rows of them that show the arms."""
_CAMERA = CameraView(azimuth=90, elevation=-30, distance=12.5, lookat=(0, 0, 0.2))
_FPS, _QUALITY = 3.0, 32


def save_many_arms(path: Path) -> None:
    """Writes the film of a plan. Raises `MmpError` if there is none."""
    problem = draw_problem(find_cell(CELL), seed=SEED)
    result = mmp_planners.make("auto", until=_UNTIL).plan(problem, seed=SEED, time_limit=60.0)
    if result.plan is None:
        raise MmpError(f"auto finds no plan on {CELL}, seed {SEED}")
    width, height = _SIZE
    shown = frames(result.plan, fps=_FPS, width=width, height=height, camera=_CAMERA, goals=False)
    *shots, last = (Shot(picture=picture[_ROWS], duration_ms=round(1e3 / _FPS)) for picture in shown)
    write_webp(path, [*shots, replace(last, duration_ms=round(1e3 * HOLD_S))], quality=_QUALITY, method=6)
