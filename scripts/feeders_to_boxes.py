"""Jobs of four arms that take parts from two feeders, show some of them to a camera, and put them into boxes."""

from __future__ import annotations

from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.work.jobs import Jobs
from mmp_env.work.jobs_file import jobs_from_dict

MOST_PARTS = 24
"""Largest number of parts."""
PART_M = (0.05, 0.05, 0.08)
ARM_M, BOX_M, CAMERA_M = (0.45, 0.5), (0.95, 0.5), (0.8, 0.2, 0.4)
"""An arm, the middle of its box, and the place before its camera; the other three mirror them."""
FEEDER_M, PITCH_M = (0.42, 0.0), (0.13, 0.2)
"""Middle of a feeder, and distances of the parts on it."""
SLOTS_M = (0.15, 0.14)
"""Distances of the parts in a box, which has room for 2 x 3."""
WALL_M, WALL_HEIGHT_M = 0.02, 0.04
GAP_M, AWAY_M = 0.002, 0.1
"""Distance of a flange from a part that it grasps; length of the lines to a part and away from it."""
GRIP_S, PICTURE_S = 0.2, 1.0
"""Time that a gripper takes to open or close, and that the camera takes."""
SHOWN = 0.5
"""Probability that the camera must see a part."""


def feeders_to_boxes(seed: int, parts: int = MOST_PARTS) -> Jobs:
    """Returns a job for each part. The seed draws which parts the camera must see. The scheduler chooses the arms.

    Raises `MmpError` for more than `MOST_PARTS` parts.
    """
    if parts > MOST_PARTS:
        raise MmpError(f"{parts} parts are too many; the feeders hold {MOST_PARTS}")
    rng = np.random.default_rng(seed)
    objects, jobs = [], []
    for number in range(parts):
        side, (column, row) = np.array([-1, 1])[[number % 2]], divmod(number // 2, 2)
        corner = np.array([side[0], (-1, 1)[row]])
        begin = corner * FEEDER_M + PITCH_M * np.array([side[0] * (column - 2.5), corner[1] / 2])
        end = corner * BOX_M + SLOTS_M * np.array([column % 2 - 0.5, column // 2 - 1])
        name = f"part{number}"
        position = [*begin.round(3).tolist(), PART_M[2] / 2]
        objects.append({"name": name, "shape": "box", "size": list(PART_M), "pose": {"position": position}})
        steps = [
            *_at(begin, {"grasp": name}),
            *(_shown(corner) if rng.random() < SHOWN else []),
            *_at(end, {"release": name}),
        ]
        jobs.append({"name": f"pack{number}", "steps": steps})
    data = {"schema": "mmp-jobs/1", "name": "feeders-to-boxes", "cell": _cell(), "objects": objects, "jobs": jobs}
    return jobs_from_dict(data, "feeders_to_boxes")


def _at(place: np.ndarray, step: dict[str, str]) -> list[dict[str, Any]]:
    """Returns the steps that grasp or release a part at a place on the table."""
    down, up = ({"line": [0.0, 0.0, sign * AWAY_M]} for sign in (-1, 1))
    return [_move([*place.tolist(), PART_M[2] + GAP_M + AWAY_M]), down, step, {"wait": GRIP_S}, up]


def _shown(corner: np.ndarray) -> list[dict[str, Any]]:
    """Returns the steps that show a part to the camera of a corner."""
    return [_move([*(corner * CAMERA_M[:2]).tolist(), CAMERA_M[2]]), {"wait": PICTURE_S}]


def _move(position: list[float]) -> dict[str, Any]:
    """Returns a move of the tool, which points down, to a position."""
    return {"move": {"pose": {"position": position, "quaternion": [0, 1, 0, 0], "free": "z"}}}


def _cell() -> dict[str, Any]:
    corners = [np.array([x, y]) for x in (-1, 1) for y in (-1, 1)]
    arms = [
        {
            "name": f"arm{k}",
            "robot": "ur5e",
            "position": [*(corner * ARM_M).tolist(), 0.0],
            "yaw": -1.571 * float(corner[1]),
        }
        for k, corner in enumerate(corners)
    ]
    table = {"name": "table", "shape": "box", "position": [0.0, 0.0, -0.05], "size": [3.0, 2.0, 0.1]}
    walls = [wall for k, corner in enumerate(corners) for wall in _walls(f"box{k}", corner * BOX_M)]
    return {"arms": arms, "obstacles": [table, *walls], "spheres": "28"}


def _walls(name: str, middle: np.ndarray) -> list[dict[str, Any]]:
    """Returns the four walls of a box on the table."""
    length, width = 2 * SLOTS_M[0] + WALL_M, 3 * SLOTS_M[1] + WALL_M
    out = []
    for k, (toward, size) in enumerate([([1, 0], [WALL_M, width]), ([0, 1], [length, WALL_M])]):
        for n, sign in enumerate((-1, 1)):
            position = middle + sign * np.array(toward) * (length / 2, width / 2)
            out.append(
                {
                    "name": f"{name}-wall{2 * k + n}",
                    "shape": "box",
                    "position": [*position.round(3).tolist(), WALL_HEIGHT_M / 2],
                    "size": [*size, WALL_HEIGHT_M],
                }
            )
    return out
