"""A picture of robots that are not built in: a cell of arms that `mmp robot add` imported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from mmp_env import draw_instance
from mmp_env.files.cell_file import cell_from_dict
from mmp_env.files.writing import plain, whole_file
from mmp_env.model.cell import Cell
from mmp_env.view.offscreen_renderer import OffscreenRenderer

ROBOTS = ("iiwa", "kinova3", "iiwa", "kinova3")
_SIZE, _RADIUS_M, _SEED = (720, 420), 0.75, 0
_TABLE = {"name": "table", "shape": "box", "position": [0.0, 0.0, -0.05], "size": [2.0, 2.0, 0.1]}


def save_imported(path: Path) -> None:
    """Writes the picture of a ring of these robots. Raises `MmpError` if one of them was not added."""
    with whole_file(path) as temporary:
        Image.fromarray(ring_picture(ring_of(ROBOTS))).save(temporary, "WEBP", quality=84, method=6)


def ring_of(robots: tuple[str, ...]) -> Cell:
    """Returns a cell of the robots around a table. Raises `MmpError` for an unknown robot."""
    turns = 2 * np.pi * np.arange(len(robots)) / len(robots)
    places = [[_RADIUS_M * np.cos(turn), _RADIUS_M * np.sin(turn), 0.0] for turn in turns.tolist()]
    arms = [
        {"name": f"arm{k}", "robot": name, "position": places[k], "yaw": turns[k] - np.pi}
        for k, name in enumerate(robots)
    ]
    return cell_from_dict(plain({"name": "imported", "arms": arms, "obstacles": [_TABLE]}), "imported")


def ring_picture(cell: Cell, size: tuple[int, int] = _SIZE) -> UInt8[np.ndarray, "h w 3"]:
    """Returns the cell at the start of a random instance."""
    start, _ = draw_instance(cell, seed=_SEED)
    with OffscreenRenderer(cell, *size) as renderer:
        return renderer.picture(start)
