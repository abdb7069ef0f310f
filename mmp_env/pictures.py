"""Pictures of a plan: one moment of it, or start, middle and end side by side, with the ways of the tools as lines."""

from __future__ import annotations

import io
from collections.abc import Iterable
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.opengl import offscreen_backend
from mmp_env.plan import Plan
from mmp_env.studio import HEIGHT, WIDTH, Studio, standing, tool_ways
from mmp_env.writing import check_writable, whole_file

SUFFIXES = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}
"""Suffix of a file -> Pillow's name of the format."""
MOMENTS = {"start": 0.0, "middle": 0.5, "end": 1.0}
"""Name of a moment -> share of the plan's duration that has passed."""
Moment = str | float
"""The name of a moment, or a time [s]."""
_QUALITY = {"JPEG": {"quality": 92}, "WEBP": {"quality": 88, "method": 4}, "PNG": {"optimize": True}}
_GAP = 4
_INK, _PAPER = (31, 36, 41), (255, 255, 255)


def check_picture(path: str | PathLike[str]) -> None:
    """Raises `MmpError` where `save_picture` could not write this file: to be called before planning begins."""
    _format(path)
    offscreen_backend()
    check_writable(path)


def picture(
    plan: Plan,
    moment: Moment = "middle",
    *,
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    goals: bool = True,
    ways: bool = True,
) -> UInt8[np.ndarray, "h w 3"]:
    """The cell at a moment of the plan: `start`, `middle`, `end` or a time [s].

    With `goals` the arms stand at their goals as ghosts too; with `ways` the ways of the tools are lines, faint where
    they have yet to go. `fine` pictures have shadows and smooth edges, and take several times as long without a
    graphics card. Raises `MmpError` for a moment or a size that cannot be, and where no OpenGL library is found.
    """
    time_s = _time(plan, moment)
    with Studio(plan.problem.cell, width, height, fine=fine) as studio:
        return _shot(studio, plan, time_s, goals=goals, ways=ways)


def pictures(
    plan: Plan,
    moments: Iterable[Moment] = tuple(MOMENTS),
    *,
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    goals: bool = True,
    ways: bool = True,
) -> UInt8[np.ndarray, "h W 3"]:
    """Several moments side by side, each `width` x `height` pixels with its name and time on it; else as `picture`."""
    chosen = list(moments)
    times = [_time(plan, moment) for moment in chosen]
    if not chosen:
        raise MmpError(f"a picture needs at least one moment: {', '.join(MOMENTS)} or a time in seconds")
    shots = []
    with Studio(plan.problem.cell, width, height, fine=fine) as studio:
        for moment, time_s in zip(chosen, times, strict=True):
            shot = _shot(studio, plan, time_s, goals=goals, ways=ways)
            name = f"{moment}, " if isinstance(moment, str) else ""
            shots.append(labelled(shot, f"{name}{time_s:.1f} s"))
    gap = np.full((height, _GAP, 3), _PAPER, np.uint8)
    return np.concatenate([part for shot in shots for part in (gap, shot)][1:], axis=1)


def save_picture(
    plan: Plan,
    path: str | PathLike[str],
    *,
    moments: Iterable[Moment] = tuple(MOMENTS),
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    goals: bool = True,
    ways: bool = True,
) -> None:
    """Writes `pictures` to a PNG, JPEG or WebP file, by its suffix. Raises `MmpError`, and then has written nothing."""
    check_picture(path)
    image = pictures(plan, moments, width=width, height=height, fine=fine, goals=goals, ways=ways)
    content = encoded(image, _format(path))
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def encoded(image: UInt8[np.ndarray, "h w 3"], format: str = "PNG") -> bytes:
    """A picture as the content of a file in one of Pillow's formats. Raises `MmpError` where it is too large for it."""
    out = io.BytesIO()
    try:
        Image.fromarray(image).save(out, format, **_QUALITY.get(format, {}))
    except (OSError, ValueError) as error:
        height, width, _ = image.shape
        raise MmpError(f"{format} cannot hold a picture of {width} x {height} pixels: {error}") from error
    return out.getvalue()


def labelled(image: UInt8[np.ndarray, "h w 3"], text: str) -> UInt8[np.ndarray, "h w 3"]:
    """The picture with a line of text in its upper left corner; a fresh array."""
    size = max(11, image.shape[0] // 24)
    drawing = Image.fromarray(image)
    place = (size // 2 + 2, size // 2)
    ImageDraw.Draw(drawing).text(place, text, fill=_INK, font=ImageFont.load_default(size))
    return np.array(drawing)


def _shot(studio: Studio, plan: Plan, time_s: float, *, goals: bool, ways: bool) -> UInt8[np.ndarray, "h w 3"]:
    ghosts = plan.problem.goal if goals and time_s < plan.makespan_s else None
    return studio.picture(standing(plan, time_s), ghosts, tool_ways(plan, time_s) if ways else ())


def _time(plan: Plan, moment: Moment) -> float:
    if isinstance(moment, str):
        if moment not in MOMENTS:
            raise UnknownNameError("moment", moment, MOMENTS)
        return MOMENTS[moment] * plan.makespan_s
    if not 0 <= moment <= plan.makespan_s:
        raise MmpError(f"moment is {moment} s; the plan goes from 0 to {plan.makespan_s:.6g} s")
    return float(moment)


def _format(path: str | PathLike[str]) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise UnknownNameError("suffix of a picture", suffix, SUFFIXES)
    return SUFFIXES[suffix]
