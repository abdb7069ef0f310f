"""Pictures of a plan: one moment of it, or start, middle and end side by side, with the ways of the tools as lines."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from mmp_env.argument_checks import refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.writing import check_writable, whole_file
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan
from mmp_env.opengl import offscreen_backend
from mmp_env.view.offscreen_renderer import HEIGHT, WIDTH, Studio, standing, tool_ways
from mmp_env.view.plan_outline import plan_outline
from mmp_env.wording import in_seconds

SUFFIXES = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}
"""Suffix of a file -> Pillow's name of the format."""
MOMENTS = {"start": 0.0, "middle": 0.5, "end": 1.0}
"""Name of a moment -> share of the plan's duration that has passed."""
Moment = str | float
"""The name of a moment, or a time [s]."""
_QUALITY = {"JPEG": {"quality": 92}, "WEBP": {"quality": 88, "method": 4}, "PNG": {"optimize": True}}
_GAP = 4
_INK, _PAPER = (31, 36, 41), (255, 255, 255)


class PictureOptions(TypedDict, total=False):
    """The options of all pictures."""

    width: int
    height: int
    """Of one picture [px], 640 x 480 by default."""
    fine: bool
    """Shadows and smooth edges, which take several times as long without a graphics card; on by default."""
    goals: bool
    """The arms at their goals as ghosts; on by default."""
    ways: bool
    """The ways of the tools as lines, faint where they have yet to go; on by default."""


def check_picture(path: str | PathLike[str], moments: Iterable[Moment] = tuple(MOMENTS)) -> None:
    """Raises `MmpError` where `save_picture` could not write this file, or no plan has such moments.

    To be called before planning begins.
    """
    _format(path)
    _times(moments, math.inf)
    check_writable(path)
    offscreen_backend()


def picture(plan: Plan, moment: Moment = "middle", **options: Unpack[PictureOptions]) -> UInt8[np.ndarray, "h w 3"]:
    """The cell at a moment of the plan: `start`, `middle`, `end` or a time [s].

    Raises `MmpError` for a moment or a size that cannot be, and where no OpenGL library is found.
    """
    plan = given_plan(plan, "show")
    return _shots(plan, _times([moment], plan.makespan_s), **options)[0]


def pictures(
    plan: Plan, moments: Iterable[Moment] = tuple(MOMENTS), **options: Unpack[PictureOptions]
) -> UInt8[np.ndarray, "h W 3"]:
    """Several moments side by side, each with its name and time on it; else as `picture`."""
    plan, chosen = given_plan(plan, "show"), list(moments)
    times = _times(chosen, plan.makespan_s)
    parts = []
    for moment, time_s, shot in zip(chosen, times, _shots(plan, times, **options), strict=True):
        name = f"{moment}, " if isinstance(moment, str) else ""
        parts += [np.full((len(shot), _GAP, 3), _PAPER, np.uint8), labelled(shot, f"{name}{in_seconds(time_s, 1)}")]
    return np.concatenate(parts[1:], axis=1)


def save_picture(
    plan: Plan,
    path: str | PathLike[str],
    *,
    moments: Iterable[Moment] = tuple(MOMENTS),
    **options: Unpack[PictureOptions],
) -> None:
    """Writes `pictures` to a PNG, JPEG or WebP file, by its suffix. Raises `MmpError`, and then has written nothing."""
    chosen = list(moments)
    check_picture(path, chosen)
    content = encoded(pictures(plan, chosen, **options), _format(path))
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


def _shots(
    plan: Plan,
    times: Iterable[float],
    *,
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    goals: bool = True,
    ways: bool = True,
) -> list[UInt8[np.ndarray, "h w 3"]]:
    """A picture for each time [s]."""
    out = []
    with Studio(plan.problem.cell, width, height, fine=fine, shown=plan_outline(plan)) as studio:
        for time_s in times:
            ghosts = plan.problem.goal if goals and time_s < plan.makespan_s else None
            lines = tool_ways(plan, time_s) if ways else ()
            out.append(studio.picture(standing(plan, time_s), ghosts, lines))
    return out


def _times(moments: Iterable[Moment], duration_s: float) -> list[float]:
    """When the moments of a plan that takes so long are [s]; at least one. Raises `MmpError`."""
    out = [_time(moment, duration_s) for moment in moments]
    if not out:
        raise MmpError(f"a picture needs at least one moment: {', '.join(MOMENTS)} or a time in seconds")
    return out


def _time(moment: Moment, duration_s: float) -> float:
    if isinstance(moment, str):
        if moment not in MOMENTS:
            raise UnknownNameError("moment", moment, MOMENTS)
        return MOMENTS[moment] * duration_s if MOMENTS[moment] else 0.0
    if isinstance(moment, bool) or not isinstance(moment, Real):
        raise refused("moment", moment, f"{', '.join(MOMENTS)} or a time in seconds")
    if not 0 <= moment <= duration_s:
        until = f"the plan goes from 0 to {duration_s:.6g} s" if math.isfinite(duration_s) else "it begins at 0"
        raise MmpError(f"moment is {moment} s; {until}")
    return float(moment)


def _format(path: str | PathLike[str]) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise UnknownNameError("suffix of a picture", suffix, SUFFIXES)
    return SUFFIXES[suffix]
