"""MP4 files (H.264, 4:2:0), encoded by the ffmpeg of imageio-ffmpeg or of the system."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import final

import numpy as np
from jaxtyping import UInt8

from mmp_env.errors import MmpError
from mmp_env.files.temporaries import unnamed_file
from mmp_env.view.animation import Encoder

_QUALITY = "20"
"""Constant rate factor of x264: 18 is visually lossless, 23 is the default."""


def find_ffmpeg() -> str:
    """Returns the path of ffmpeg. Raises `MmpError` that says how to install it."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError):  # not installed, or without a program for this machine
        program = shutil.which("ffmpeg")
    if program is None:
        raise MmpError(
            "an MP4 film needs ffmpeg; get it with: pip install 'mmp-env[film]' (.gif and .webp films need nothing)"
        )
    return program


@final
class Mp4Encoder(Encoder):
    """Passes raw frames to an ffmpeg process, which ends with the context."""

    usual_fps = 25.0

    def __init__(self, path: Path, width: int, height: int, fps: float) -> None:
        self._fps, self._last = fps, b""
        self._log = unnamed_file()  # closed with the context
        frames = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "pipe:"]
        video = ["-c:v", "libx264", "-preset", "medium", "-crf", _QUALITY, "-pix_fmt", "yuv420p"]
        # Players guess the colours of a film that does not name its colour space.
        named = "setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv"
        colors = ["-vf", f"scale=out_color_matrix=bt709:out_range=tv,{named}"]
        out = ["-movflags", "+faststart", "-f", "mp4", str(path)]
        process = subprocess.Popen(
            [find_ffmpeg(), "-loglevel", "error", "-y", *frames, "-an", *colors, *video, *out],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._log,
            start_new_session=True,  # this process handles Ctrl-C
        )
        assert process.stdin is not None
        self._process, self._pipe = process, process.stdin

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.kill()
        with contextlib.suppress(OSError):  # ffmpeg cannot receive the rest of the buffer
            self._pipe.close()
        self._process.wait()
        self._log.close()

    @classmethod
    def check_size(cls, width: int, height: int) -> None:
        for name, value in (("width", width), ("height", height)):
            if value % 2:
                raise MmpError(f"{name} is {value}; an MP4 film has an even number of pixels in both directions")

    def add(self, frame: UInt8[np.ndarray, "h w 3"]) -> None:
        self._write(frame.tobytes())

    def finish(self, hold_s: float) -> None:
        for _ in range(round(hold_s * self._fps)):
            self._write(self._last)
        with self._failures_reported():
            self._pipe.close()
        if self._process.wait() != 0:
            raise self._failure()

    def _write(self, frame: bytes) -> None:
        self._last = frame
        with self._failures_reported():
            self._pipe.write(frame)

    @contextlib.contextmanager
    def _failures_reported(self) -> Iterator[None]:
        """Turns a pipe that ffmpeg has closed into the error that ffmpeg reports."""
        try:
            yield
        except BrokenPipeError:
            self._process.wait()
            raise self._failure() from None

    def _failure(self) -> MmpError:
        self._log.seek(0)
        words = self._log.read().decode(errors="replace").strip().splitlines() or ["it does not say why"]
        return MmpError(f"ffmpeg cannot write the film: {words[-1]}")
