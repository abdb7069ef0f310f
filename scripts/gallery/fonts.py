"""Font and colours of text in pictures: DejaVu Sans, which matplotlib contains, so that all machines draw the same."""

from __future__ import annotations

import functools
from pathlib import Path

import matplotlib
from PIL import ImageFont

INK, FAINT, PAPER, LINE, SOLUTION_PATH = (31, 36, 41), (93, 102, 112), (252, 252, 253), (154, 163, 173), (0, 114, 178)
ALARM = (204, 32, 39)


@functools.cache
def font(size: float, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Returns the font at a size [px]."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)
