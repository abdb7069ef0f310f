"""Films of a plan in real time, as it was executed or as it is: MP4, and GIF or WebP for pages and notebooks."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.argument_checks import given, known_keywords, number, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.writing import check_writable, whole_file
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan
from mmp_env.opengl import offscreen_backend
from mmp_env.sim.execution import ExecutionReport
from mmp_env.view.animation import Encoder, GifEncoder, WebpEncoder
from mmp_env.view.ffmpeg import Mp4Encoder, find_ffmpeg
from mmp_env.view.offscreen_renderer import HEIGHT, WIDTH, State, Studio, standing, tool_ways
from mmp_env.view.plan_outline import plan_outline

ENCODERS: dict[str, type[Encoder]] = {".mp4": Mp4Encoder, ".gif": GifEncoder, ".webp": WebpEncoder}
"""Suffix of a file -> what writes it."""
HOLD_S = 1.0
"""A film stands still at its end this long."""
MOST_FRAMES = 90_000
"""Largest number of frames in a film: an hour at 25 a second."""
_MOST_FPS = 60.0

Progress = Callable[[int, int], None]
"""Called with how many frames are made, and of how many."""


def check_film(path: str | PathLike[str]) -> None:
    """Raises `MmpError` where `save_film` could not write this file: to be called before planning begins."""
    if _encoder(path) is Mp4Encoder:
        find_ffmpeg()
    check_writable(path)
    offscreen_backend()


@known_keywords
def save_film(
    plan: Plan,
    path: str | PathLike[str],
    report: ExecutionReport | None = None,
    *,
    fps: float | None = None,
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    goals: bool = True,
    ways: bool = False,
    progress: Progress = lambda done, total: None,
) -> None:
    """Writes a film of what `report` recorded, or without one of the plan itself: `.mp4`, `.gif` or `.webp`.

    `fps` frames a second, 25 or in a GIF and WebP 10, show it in real time; `width` and `height` are even for an MP4.
    The other options as in `frames`. The file is there when all of it is; what is interrupted leaves nothing. Raises
    `MmpError`.
    """
    check_film(path)
    kind = _encoder(path)
    fps = kind.usual_fps if fps is None else fps
    times = frame_times(_duration(plan, report), fps)
    kind.check_size(width, height)
    shown = frames(plan, report, fps=fps, width=width, height=height, fine=fine, goals=goals, ways=ways)
    # The generator is closed here and now: it holds an OpenGL context.
    with whole_file(path) as temporary, kind(temporary, width, height, fps) as encoder, closing(shown):
        for count, frame in enumerate(shown, 1):
            encoder.add(frame)
            progress(count, len(times))
        encoder.finish(HOLD_S)


def frames(
    plan: Plan,
    report: ExecutionReport | None = None,
    *,
    fps: float = 25.0,
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    goals: bool = True,
    ways: bool = False,
    shown: Float[np.ndarray, "p 3"] | None = None,
) -> Generator[UInt8[np.ndarray, "h w 3"]]:
    """The pictures of a film one by one, at `frame_times`: as it was executed, or without a report as it is planned.

    With `goals` the arms stand at their goals as ghosts; with `ways` the ways of their tools are lines. The points
    `shown` [m] fill the picture, by default the `plan_outline`. Raises `MmpError` for numbers that cannot be, and where
    no OpenGL library is found.
    """
    times = frame_times(_duration(plan, report), fps)
    shown = plan_outline(plan) if shown is None else shown
    with Studio(plan.problem.cell, width, height, fine=fine, shown=shown) as studio:
        for time_s, q in zip(times, _configurations(plan, report, times), strict=True):
            lines = tool_ways(plan, min(float(time_s), plan.makespan_s)) if ways else ()
            yield studio.picture(q, plan.problem.goal if goals else None, lines)


def frame_times(duration_s: float, fps: float) -> Float[np.ndarray, "n"]:
    """When the frames of a film are [s]: from 0 on at equal steps, the last one not before `duration_s`."""
    allowed = f"more than 0 and at most {_MOST_FPS:g} frames a second"
    if number("fps", fps, allowed) > _MOST_FPS:
        raise refused("fps", fps, allowed)
    count = duration_s * fps
    if not count <= MOST_FRAMES:
        raise MmpError(
            f"the film would take {duration_s:.6g} s; at {fps:g} frames a second it can take {MOST_FRAMES / fps:.6g} s"
        )
    return np.arange(math.ceil(count - 1e-6) + 1) / fps


def _duration(plan: Plan, report: ExecutionReport | None) -> float:
    plan = given_plan(plan, "film")
    if report is None:
        return plan.makespan_s
    return float(given("report", report, ExecutionReport, "what execute() returned, or None").times[-1])


def _configurations(plan: Plan, report: ExecutionReport | None, times: Iterable[float]) -> Iterator[State]:
    for time_s in times:
        if report is None:
            yield standing(plan, float(time_s))
            continue
        last = len(report.times) - 1  # a recording is so dense that the nearest moment will do
        k = min(int(np.searchsorted(report.times, time_s - 1e-9)), last)
        yield {name: report.positions[name][k] for name in plan.problem.cell.arm_names}


def _encoder(path: str | PathLike[str]) -> type[Encoder]:
    suffix = Path(path).suffix.lower()
    if suffix not in ENCODERS:
        raise UnknownNameError("suffix of a film", suffix, ENCODERS)
    return ENCODERS[suffix]
