"""Pictures of a plan: one moment, or several side by side, with the tool paths as lines."""

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

from mmp_env import argument_checks
from mmp_env.argument_checks import refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.writing import check_writable, whole_file
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan
from mmp_env.opengl import offscreen_backend
from mmp_env.sim.camera_view import GivenView
from mmp_env.view.offscreen_renderer import (
    WIDE,
    WIDTH,
    OffscreenRenderer,
    configuration_at,
    fitting_height,
    plan_outline,
    tool_path_lines,
)
from mmp_env.wording import in_seconds

SUFFIXES = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}
"""Suffix of a file -> Pillow's name of the format."""
MOMENTS = {"start": 0.0, "middle": 0.5, "end": 1.0}
"""Name of a moment -> share of the plan's duration before it."""
MOST_MOMENTS = 100
"""Largest number of moments in a picture."""
Moment = str | float
"""Type of a moment: a name from `MOMENTS`, or a time [s]."""
_QUALITY = {"JPEG": {"quality": 92}, "WEBP": {"quality": 88, "method": 4}, "PNG": {"optimize": True}}
_GAP = 4
_INK, _PAPER = (31, 36, 41), (255, 255, 255)


class PictureOptions(TypedDict, total=False):
    """The options of all pictures."""

    width: int
    height: int
    """Size of one picture [px]; default: 640 x 480, with less height if the motion is over twice as wide."""
    fine: bool
    """Shadows and smooth edges; default: on. Without a graphics card they take several times as long."""
    goals: bool
    """Transparent arms at their goals; default: on."""
    tool_paths: bool
    """Tool paths as lines, fainter after the moment that is shown; default: on."""
    camera: GivenView
    """A `CameraView`, its name or its numbers, see `as_camera_view`; default: obliquely from above."""


def check_picture(path: str | PathLike[str], moments: Iterable[Moment] = tuple(MOMENTS)) -> None:
    """Raises `MmpError` if `save_picture` could not write this file, or if no plan has such moments.

    Callers check this before they plan.
    """
    picture_format(path)
    _times(moments, math.inf)
    check_writable(path)
    offscreen_backend()


def picture(plan: Plan, moment: Moment = "middle", **options: Unpack[PictureOptions]) -> UInt8[np.ndarray, "h w 3"]:
    """Returns a picture [height, width, 3] of one moment of the plan.

    Args:
        plan: the plan.
        moment: `start`, `middle`, `end` or a time [s].
        **options: see `PictureOptions`.

    Raises:
        MmpError: for a moment or a size that is not allowed, and if no OpenGL library is found.
    """
    plan = given_plan(plan, "show")
    return _shots(plan, _times([moment], plan.makespan_s), **options)[0]


def pictures(
    plan: Plan, moments: Iterable[Moment] = tuple(MOMENTS), **options: Unpack[PictureOptions]
) -> UInt8[np.ndarray, "h W 3"]:
    """Returns pictures of several moments side by side, each with its name and time. See `picture`.

    Pictures that are more than `WIDE` times as wide as high stand below each other.
    """
    plan, chosen = given_plan(plan, "show"), _listed(moments)
    times = _times(chosen, plan.makespan_s)
    shots, parts = _shots(plan, times, **options), []
    height, width, _ = shots[0].shape
    below = width > WIDE * height
    gap = np.full((_GAP, width, 3) if below else (height, _GAP, 3), _PAPER, np.uint8)
    for moment, time_s, shot in zip(chosen, times, shots, strict=True):
        name = f"{moment}, " if isinstance(moment, str) else ""
        parts += [gap, labelled(shot, f"{name}{in_seconds(time_s, 1)}")]
    return np.concatenate(parts[1:], axis=0 if below else 1)


def save_picture(
    plan: Plan,
    path: str | PathLike[str],
    *,
    moments: Iterable[Moment] = tuple(MOMENTS),
    **options: Unpack[PictureOptions],
) -> None:
    """Writes `pictures` to a PNG, JPEG or WebP file, by its suffix.

    Args:
        plan: the plan.
        path: file to write, `.png`, `.jpg`, `.jpeg` or `.webp`.
        moments: names of moments or times [s], shown side by side.
        **options: see `PictureOptions`.

    Raises:
        MmpError: as `picture`, and if the file cannot be written. Then nothing is written.
    """
    plan, chosen = given_plan(plan, "show"), _listed(moments)
    check_picture(path, chosen)
    content = encoded(pictures(plan, chosen, **options), picture_format(path))
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def encoded(image: UInt8[np.ndarray, "h w 3"], format: str = "PNG") -> bytes:
    """Returns an image file in one of Pillow's formats, as bytes. Raises `MmpError` if the picture is too large."""
    out = io.BytesIO()
    try:
        Image.fromarray(image).save(out, format, **_QUALITY.get(format, {}))
    except (OSError, ValueError) as error:
        height, width, _ = image.shape
        raise MmpError(f"{format} cannot hold a picture of {width} x {height} pixels: {error}") from error
    return out.getvalue()


def labelled(image: UInt8[np.ndarray, "h w 3"], text: str) -> UInt8[np.ndarray, "h w 3"]:
    """Returns a copy of the picture with a line of text in its upper left corner."""
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
    height: int | None = None,
    fine: bool = True,
    goals: bool = True,
    tool_paths: bool = True,
    camera: GivenView = None,
) -> list[UInt8[np.ndarray, "h w 3"]]:
    """Returns a picture for each time [s]."""
    out, shown = [], plan_outline(plan)
    height = fitting_height(shown, width, camera) if height is None else height
    with OffscreenRenderer(plan.problem.cell, width, height, fine=fine, shown=shown, camera=camera) as renderer:
        for time_s in times:
            ghosts = plan.problem.goal if goals and time_s < plan.makespan_s else None
            lines = tool_path_lines(plan, time_s) if tool_paths else ()
            out.append(renderer.picture(configuration_at(plan, time_s), ghosts, lines))
    return out


def _times(moments: Iterable[Moment], duration_s: float) -> list[float]:
    """Returns the times [s] of the moments of a plan with this duration. Raises `MmpError` if there are none."""
    out = [_time(moment, duration_s) for moment in _listed(moments)]
    if len(out) > MOST_MOMENTS:
        raise MmpError(f"a picture of {len(out)} moments was asked for; it has {MOST_MOMENTS} at most")
    if not out:
        raise MmpError(f"a picture needs at least one moment: {', '.join(MOMENTS)} or a time in seconds")
    return out


def _listed(moments: Iterable[Moment]) -> list[Moment]:
    """Returns the moments as a list. Raises `MmpError` for a single moment."""
    if isinstance(moments, str) or not isinstance(moments, Iterable):
        raise refused("moments", moments, "a list of moments, such as ['end'] or [2.5]")
    return list(moments)


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


def picture_format(path: str | PathLike[str]) -> str:
    """Returns Pillow's name of the format that the suffix of a file stands for. Raises `UnknownNameError`."""
    suffix = Path(argument_checks.path("path", path)).suffix.lower()
    if suffix not in SUFFIXES:
        raise UnknownNameError("suffix of a picture", suffix, SUFFIXES)
    return SUFFIXES[suffix]
