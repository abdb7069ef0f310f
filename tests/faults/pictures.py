"""Compares pictures and films that OpenGL drew while it lacked memory: it may draw a little differently then."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image, ImageSequence

MOST_DIFFERENCE = 2.0
"""Largest mean difference of the colours of a picture, of 255; 1.2 is the largest that we have seen."""
_FILM = ".mp4"
PICTURES = (".png", ".jpg", ".webp", ".gif", _FILM)
"""Suffixes of pictures and films."""


def unlike(path: Path, good: Path) -> str | None:
    """Returns how a picture or film differs from the good one more than by the drawing of edges and shades, or None."""
    for number, (one, other) in enumerate(zip_longest(_frames(path), _frames(good))):
        if one is None or other is None:
            return f"another number of frames than the good run, from frame {number} on"
        if one.shape != other.shape:
            return f"frames of {one.shape[1]} x {one.shape[0]} pixels, not of {other.shape[1]} x {other.shape[0]}"
        if (difference := float(np.abs(one - other).mean())) > MOST_DIFFERENCE:
            return f"frame {number} differs from that of the good run by {difference:.1f} of 255 on average"
    return None


def _frames(path: Path) -> Iterator[np.ndarray]:
    """Yields the frames [height, width, 3] of a picture or film."""
    if path.suffix != _FILM:
        with Image.open(path) as picture:
            for frame in ImageSequence.Iterator(picture):
                yield np.asarray(frame.convert("RGB")).astype(int)
        return
    frames = imageio_ffmpeg.read_frames(str(path))
    width, height = next(frames)["size"]
    for frame in frames:
        yield np.frombuffer(frame, np.uint8).reshape(height, width, 3).astype(int)
