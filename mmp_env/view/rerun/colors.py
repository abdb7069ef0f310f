"""Colours of recordings, as bytes.

The viewer draws graphs, curves and bars on the dark or light background of its theme. Their colours have enough
contrast on both.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from jaxtyping import UInt8

from mmp_env.model.cell import Cell
from mmp_env.sim.arm_colors import arm_color
from mmp_env.view.tree_drawing.colors import contrast

CONTACT = (235, 0, 40)
BEFORE, AFTER = (130, 130, 130), (0, 0, 0)
FORCE = (200, 0, 90)
CHOSEN = (0, 130, 60)
"""Colour of the chosen candidate of a goal."""
BACKGROUND = (238, 240, 243)
"""Background of the 3D views in both themes."""
THEMES = ((13, 13, 13), (255, 255, 255))
"""Backgrounds of the viewer's dark and light theme (rerun 0.41)."""
LEAST_CONTRAST = 3.0
"""Least contrast ratio of graphical objects on either background (WCAG 2.2, 1.4.11)."""
_STEP = 0.02


def arm_colors(cell: Cell) -> dict[str, UInt8[np.ndarray, "3"]]:
    """Returns arm name -> red, green, blue."""
    return {name: np.rint(255 * np.array(arm_color(k))).astype(np.uint8) for k, name in enumerate(cell.arm_names)}


def curve_colors(cell: Cell) -> dict[str, UInt8[np.ndarray, "3"]]:
    """Returns arm name -> the arm's colour, darker or lighter if a thin line of it were illegible in a theme."""
    return {name: legible(color) for name, color in arm_colors(cell).items()}


def legible(color: UInt8[np.ndarray, "3"] | tuple[int, int, int]) -> UInt8[np.ndarray, "3"]:
    """Returns the nearest darker or lighter colour that has `LEAST_CONTRAST` on both backgrounds."""
    out = np.array(color, dtype=float)
    dark, light = THEMES
    while theme_contrast(out, light) < LEAST_CONTRAST:
        out *= 1 - _STEP
    while theme_contrast(out, dark) < LEAST_CONTRAST:
        out += _STEP * (255 - out)
    return np.rint(out).astype(np.uint8)


def theme_contrast(color: Iterable[float], background: Iterable[float]) -> float:
    """Returns the contrast ratio of two colours given as red, green, blue in 0..255."""
    one, other = ("#" + bytes(round(part) for part in parts).hex() for parts in (color, background))
    return contrast(one, other)


def pale(color: UInt8[np.ndarray, "3"]) -> UInt8[np.ndarray, "3"]:
    """Returns the colour mixed with three times as much background."""
    return np.rint(0.25 * color + 0.75 * np.array(BACKGROUND)).astype(np.uint8)
