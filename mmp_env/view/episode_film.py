"""Films of an episode as it is executed: its plans in a row, with the objects where each plan has them."""

from __future__ import annotations

from contextlib import closing
from os import PathLike
from pathlib import Path

import numpy as np

from mmp_env.files.episode_file import Episode
from mmp_env.files.writing import whole_file
from mmp_env.sim.camera_view import GivenView, as_camera_view
from mmp_env.sim.episode_execution import EpisodeExecution, execute_episode
from mmp_env.view.films import ENCODERS, HOLD_S, check_film, frames
from mmp_env.view.offscreen_renderer import HEIGHT, WIDTH, plan_outline


def save_episode_film(
    episode: Episode,
    path: str | PathLike[str],
    execution: EpisodeExecution | None = None,
    *,
    width: int = WIDTH,
    height: int = HEIGHT,
    fine: bool = True,
    camera: GivenView = None,
) -> None:
    """Writes a film of an executed episode in real time. An interrupted film leaves no file.

    Args:
        episode: the episode.
        path: file to write, `.mp4`, `.gif` or `.webp`.
        execution: what `execute_episode` returned; without it the episode is executed now.
        width: width [px], even for an MP4.
        height: height [px], even for an MP4.
        fine: whether the film has shadows and smooth edges.
        camera: as in `save_film`.

    Raises:
        MmpError: as `save_film` and `execute_episode`.
    """
    check_film(path)
    view = as_camera_view(camera)
    kind = ENCODERS[Path(path).suffix.lower()]
    kind.check_size(width, height)
    execution = execute_episode(episode) if execution is None else execution
    outline = np.concatenate([plan_outline(plan) for plan in episode.plans])  # the camera stands still
    with whole_file(path) as temporary, kind(temporary, width, height, kind.usual_fps) as encoder:
        for plan, report in zip(episode.plans, execution.reports, strict=True):
            shown = frames(
                plan,
                report,
                fps=kind.usual_fps,
                width=width,
                height=height,
                fine=fine,
                camera=view,
                shown=outline,
            )
            with closing(shown):
                for frame in shown:
                    encoder.add(frame)
        encoder.finish(HOLD_S)
