"""Films of a plan or of its execution in real time: MP4, GIF and WebP."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env import argument_checks
from mmp_env.argument_checks import given, known_keywords, number, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.writing import check_writable, whole_file
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import given_plan
from mmp_env.opengl import offscreen_backend
from mmp_env.sim.camera_view import GivenView, as_camera_view
from mmp_env.sim.execution import ExecutionReport
from mmp_env.view.animation import Encoder, GifEncoder, WebpEncoder
from mmp_env.view.ffmpeg import Mp4Encoder, find_ffmpeg
from mmp_env.view.offscreen_renderer import (
    WIDTH,
    OffscreenRenderer,
    State,
    configuration_at,
    fitting_height,
    plan_outline,
    tool_path_lines,
)

ENCODERS: dict[str, type[Encoder]] = {".mp4": Mp4Encoder, ".gif": GifEncoder, ".webp": WebpEncoder}
"""Suffix of a file -> its encoder."""
HOLD_S = 1.0
"""Duration [s] of the last frame."""
MOST_FRAMES = 90_000
"""Largest number of frames in a film: an hour at 25 a second."""
_MOST_FPS = 60.0

Progress = Callable[[int, int], None]
"""Callback with the number of frames made so far and the number of all frames."""


def check_film(path: str | PathLike[str]) -> None:
    """Raises `MmpError` if `save_film` could not write this file. Callers check this before they plan."""
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
    height: int | None = None,
    fine: bool = True,
    goals: bool = True,
    tool_paths: bool = False,
    camera: GivenView = None,
    progress: Progress = lambda done, total: None,
) -> None:
    """Writes a film of a plan, or of its execution, in real time. An interrupted film leaves no file.

    Args:
        plan: the plan.
        path: file to write, `.mp4`, `.gif` or `.webp`.
        report: what `execute` returned; without it the film shows the plan itself.
        fps: frames per second; default: 25 for MP4, 10 for GIF and WebP.
        width: width [px], even for an MP4.
        height: height [px], even for an MP4; by default 480, or less for a cell twice as wide as high.
        fine: whether the film has shadows and smooth edges.
        goals: whether the goals are shown as transparent arms.
        tool_paths: whether the tool paths are shown as lines.
        camera: a `CameraView`, its name or its numbers, see `as_camera_view`; by default obliquely from above.
        progress: called after each frame.

    Raises:
        MmpError: for an unknown suffix, camera or number, and if no OpenGL library or no ffmpeg is found.
    """
    given_plan(plan, "film")
    check_film(path)
    kind = _encoder(path)
    fps = kind.usual_fps if fps is None else fps
    times = frame_times(_duration(plan, report), fps)
    camera = as_camera_view(camera)
    height = fitting_height(plan_outline(plan), width, camera) if height is None else height
    kind.check_size(width, height)
    shown = frames(
        plan,
        report,
        fps=fps,
        width=width,
        height=height,
        fine=fine,
        goals=goals,
        tool_paths=tool_paths,
        camera=camera,
    )
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
    height: int | None = None,
    fine: bool = True,
    goals: bool = True,
    tool_paths: bool = False,
    camera: GivenView = None,
    shown: Float[np.ndarray, "p 3"] | None = None,
) -> Generator[UInt8[np.ndarray, "h w 3"]]:
    """Yields the frames of a film [height, width, 3] at `frame_times`. The arguments are those of `save_film`.

    `shown` are the points [p, 3] that the picture must contain [m], by default the `plan_outline`. Raises `MmpError`
    for numbers that are not allowed, and if no OpenGL library is found.
    """
    times = frame_times(_duration(plan, report), fps)
    shown = plan_outline(plan) if shown is None else shown
    height = fitting_height(shown, width, camera) if height is None else height
    with OffscreenRenderer(plan.problem.cell, width, height, fine=fine, shown=shown, camera=camera) as renderer:
        for time_s, q in zip(times, _configurations(plan, report, times), strict=True):
            lines = tool_path_lines(plan, min(float(time_s), plan.makespan_s)) if tool_paths else ()
            yield renderer.picture(q, plan.problem.goal if goals else None, lines)


def frame_times(duration_s: float, fps: float) -> Float[np.ndarray, "n"]:
    """Returns the times [n] of the frames [s]: equal steps from 0; the last one is not before `duration_s`."""
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
            yield configuration_at(plan, float(time_s))
            continue
        last = len(report.times) - 1  # the recording is dense: the nearest moment is close enough
        k = min(int(np.searchsorted(report.times, time_s - 1e-9)), last)
        yield {name: report.positions[name][k] for name in plan.problem.cell.arm_names}


def _encoder(path: str | PathLike[str]) -> type[Encoder]:
    suffix = Path(argument_checks.path("path", path)).suffix.lower()
    if suffix not in ENCODERS:
        raise UnknownNameError("suffix of a film", suffix, ENCODERS)
    return ENCODERS[suffix]
