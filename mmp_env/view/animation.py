"""Animated GIF and WebP files, written in blocks of frames. `ffmpeg.py` writes MP4."""

from __future__ import annotations

import io
import struct
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np
from jaxtyping import UInt8
from PIL import GifImagePlugin, Image, ImageChops

_BLOCK_BYTES = 2**25
"""Size of a block: 36 frames of 640 x 480."""
_SAMPLES = 12
"""Number of frames of the first block that the palette of a GIF is computed from."""
_COLORS = 255
"""Number of colours in a GIF; the last of 256 means unchanged pixels."""
_CLEAR, _KEEP = 255, 1
"""Palette index of unchanged pixels, and GIF's code for a frame that stays visible."""
_ANIMATED, _WITH_256_COLORS = 0x02, 0xF7
"""Flags of a WebP file and of a GIF."""

Frame = UInt8[np.ndarray, "h w 3"]


class Encoder(ABC):
    """Writes frames of one size to a file; a context manager. `usual_fps` is the default frame rate."""

    usual_fps: ClassVar[float]

    @abstractmethod
    def __init__(self, path: Path, width: int, height: int, fps: float) -> None: ...

    def __enter__(self) -> Encoder:
        return self

    @abstractmethod
    def __exit__(self, *_: object) -> None:
        """Releases all resources; the file may be incomplete."""

    @classmethod
    @abstractmethod
    def check_size(cls, width: int, height: int) -> None:
        """Raises `MmpError` if the format cannot have frames of this size."""

    @abstractmethod
    def add(self, frame: Frame) -> None:
        """Adds a frame."""

    @abstractmethod
    def finish(self, hold_s: float) -> None:
        """Shows the last frame for `hold_s` [s] longer and completes the file. Raises `MmpError`."""


class _Looped(Encoder):
    """Encoder of looped animations. It collects frames until a block is full or the film ends."""

    usual_fps = 10.0
    _tick_ms: ClassVar[int]

    def __init__(self, path: Path, width: int, height: int, fps: float) -> None:
        self._size, self._fps = (width, height), fps
        self._file = path.open("wb")
        self._block: list[Frame] = []
        self._written = 0

    def __exit__(self, *_: object) -> None:
        self._block.clear()
        self._file.close()

    @classmethod
    def check_size(cls, width: int, height: int) -> None:
        """Accepts every size."""

    def add(self, frame: Frame) -> None:
        if self._block and sum(held.nbytes for held in self._block) + frame.nbytes > _BLOCK_BYTES:
            self._flush(0.0)
        self._block.append(frame)

    def finish(self, hold_s: float) -> None:
        self._flush(hold_s)
        self._end()

    def _flush(self, hold_s: float) -> None:
        self._write(self._block, self._durations(hold_s))
        self._written += len(self._block)
        self._block.clear()

    def _durations(self, hold_s: float) -> list[int]:
        """Returns the duration of each frame [ms] in whole ticks of the format, without drift."""
        numbers = self._written + np.arange(len(self._block) + 1)
        ticks = np.rint(numbers * (1e3 / self._fps / self._tick_ms)).astype(int)
        out = (np.diff(ticks) * self._tick_ms).tolist()
        out[-1] += round(1e3 * hold_s / self._tick_ms) * self._tick_ms
        return out

    @abstractmethod
    def _write(self, frames: list[Frame], durations_ms: list[int]) -> None:
        """Writes a block."""

    @abstractmethod
    def _end(self) -> None:
        """Writes the end of the file."""


@final
class WebpEncoder(_Looped):
    """Animated WebP: true colours, a fraction of the size of a GIF. Browsers, Jupyter and GitHub show it.

    Each block is an animation of Pillow's, whose frames (chunks `ANMF`) are put one after the other into one file, as
    https://developers.google.com/speed/webp/docs/riff_container has it.
    """

    _tick_ms = 1

    def _write(self, frames: list[Frame], durations_ms: list[int]) -> None:
        if not self._written:
            self._file.write(self._head())
        first, *rest = (Image.fromarray(frame) for frame in frames)
        options: dict[str, Any] = {"quality": 80, "method": 3, "duration": [*durations_ms, 1], "save_all": True}
        block = io.BytesIO()
        # One frame alone is no animation, so a different second frame follows, which is dropped afterwards.
        other = ImageChops.invert(Image.fromarray(frames[-1]))
        first.save(block, "WEBP", append_images=[*rest, other], **options)
        self._file.writelines(list(_chunks(block.getvalue()))[:-1])

    def _head(self) -> bytes:
        """Returns the header of an endless file without transparency; its size is set at the end."""
        corner = b"".join((side - 1).to_bytes(3, "little") for side in self._size)
        canvas = struct.pack("<4sIB3x", b"VP8X", 10, _ANIMATED) + corner
        return struct.pack("<4sI4s", b"RIFF", 0, b"WEBP") + canvas + struct.pack("<4sI4xH", b"ANIM", 6, 0)

    def _end(self) -> None:
        size = self._file.tell() - 8
        self._file.seek(4)
        self._file.write(struct.pack("<I", size))


@final
class GifEncoder(_Looped):
    """Animated GIF with one palette for all frames; each frame has only the changed pixels.

    The palette is that of the first block: the camera stands still, and all arms are in sight.
    """

    _tick_ms = 10

    def _write(self, frames: list[Frame], durations_ms: list[int]) -> None:
        if not self._written:
            self._palette, self._before = _common_palette(frames), None
            self._file.write(self._head())
        for frame, duration_ms in zip(frames, durations_ms, strict=True):
            image = Image.fromarray(frame).quantize(palette=self._palette, dither=Image.Dither.NONE)
            now = np.array(image)
            corner, part = _changed(self._before, now)
            image = Image.fromarray(part, "P")
            options: dict[str, Any] = {"duration": duration_ms, "transparency": _CLEAR, "disposal": _KEEP}
            self._file.writelines(GifImagePlugin.getdata(image, corner, **options))
            self._before = now

    def _head(self) -> bytes:
        """Returns the header of an endless file with one palette of 256 colours."""
        colors = bytes(self._palette.getpalette() or ()).ljust(768, b"\0")[:768]
        screen = struct.pack("<6sHHBBB", b"GIF89a", *self._size, _WITH_256_COLORS, 0, 0)
        return screen + colors + b"\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0"

    def _end(self) -> None:
        self._file.write(b"\x3b")


def _chunks(riff: bytes) -> Iterator[bytes]:
    """Yields the frames of a WebP file, each with its header and padding."""
    at = 12
    while at < len(riff):
        kind, size = struct.unpack_from("<4sI", riff, at)
        end = at + 8 + size + size % 2
        if kind == b"ANMF":
            yield riff[at:end]
        at = end


def _common_palette(frames: list[Frame]) -> Image.Image:
    chosen = np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).round().astype(int))
    together = np.concatenate([frames[k] for k in chosen])
    return Image.fromarray(together).quantize(_COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)


def _changed(
    before: UInt8[np.ndarray, "h w"] | None, now: UInt8[np.ndarray, "h w"]
) -> tuple[tuple[int, int], UInt8[np.ndarray, "r c"]]:
    """Returns the corner (x, y) and the pixels of the changed rectangle, at least one pixel."""
    if before is None:
        return (0, 0), now
    different = now != before
    rows, columns = np.flatnonzero(different.any(axis=1)), np.flatnonzero(different.any(axis=0))
    if not len(rows):
        return (0, 0), np.full((1, 1), _CLEAR, np.uint8)
    here = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return (int(columns[0]), int(rows[0])), np.where(different[here], now[here], np.uint8(_CLEAR))
