"""Colours of recordings, as bytes."""

from __future__ import annotations

import numpy as np
from jaxtyping import UInt8

from mmp_env.arm_colors import arm_color
from mmp_env.cell import Cell

CONTACT = (235, 0, 40)
BEFORE, AFTER = (130, 130, 130), (0, 0, 0)
FORCE = (200, 0, 90)
BACKGROUND = (238, 240, 243)


def arm_colors(cell: Cell) -> dict[str, UInt8[np.ndarray, "3"]]:
    """Arm name -> red, green, blue."""
    return {name: np.rint(255 * np.array(arm_color(k))).astype(np.uint8) for k, name in enumerate(cell.arm_names)}


def pale(color: UInt8[np.ndarray, "3"]) -> UInt8[np.ndarray, "3"]:
    """The same, nearly gone into the background."""
    return np.rint(0.25 * color + 0.75 * np.array(BACKGROUND)).astype(np.uint8)
