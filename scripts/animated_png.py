"""Animated PNG files with a palette: a first picture, then what changes. Browsers play them, and so does GitHub."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

import numpy as np
from jaxtyping import Int, UInt8

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_BITS, _LEVELS = 6, 64
_ROUNDS = 6


def animated_png(frames: UInt8[np.ndarray, "t h w 3"], durations_ms: Sequence[int], colors: int) -> bytes:
    """The file's content; it plays for ever. `colors` (at most 255) is the size of the palette."""
    palette, pictures = reduce_colors(frames, colors)
    count, height, width = pictures.shape
    same = len(palette)  # the transparent entry: what was there stays
    opacity = b"\xff" * same + b"\0"
    out = [
        _SIGNATURE,
        _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        _chunk(b"acTL", struct.pack(">II", count, 0)),
        _chunk(b"PLTE", palette.tobytes() + b"\0\0\0"),
        _chunk(b"tRNS", opacity),
    ]
    number = 0
    for k, duration in enumerate(durations_ms):
        over = k > 0
        control = struct.pack(">IIIIIHHBB", number, width, height, 0, 0, duration, 1000, 0, over)
        out.append(_chunk(b"fcTL", control))
        number += 1
        if not over:
            out.append(_chunk(b"IDAT", _packed(pictures[0])))
            continue
        changes = np.where(pictures[k] == pictures[k - 1], same, pictures[k])
        out.append(_chunk(b"fdAT", struct.pack(">I", number) + _packed(changes.astype(np.uint8))))
        number += 1
    return b"".join([*out, _chunk(b"IEND", b"")])


def reduce_colors(
    frames: UInt8[np.ndarray, "t h w 3"], count: int
) -> tuple[UInt8[np.ndarray, "c 3"], UInt8[np.ndarray, "t h w"]]:
    """A palette for all frames and the frames as places in it: k-means on a coarse histogram, from its highest bins."""
    coarse = (frames >> (8 - _BITS)).astype(np.int32)
    bins = ((coarse[..., 0] * _LEVELS + coarse[..., 1]) * _LEVELS + coarse[..., 2]).ravel()
    _, which, sizes = np.unique(bins, return_inverse=True, return_counts=True)
    colors = np.stack([np.bincount(which, frames[..., c].ravel()) for c in range(3)], axis=1) / sizes[:, None]
    weights = np.sqrt(sizes)  # large plain areas need fewer entries than their share
    centers = colors[np.argsort(-weights)[:count]]
    for _ in range(_ROUNDS):
        nearest = _nearest(colors, centers)
        total = np.bincount(nearest, weights, len(centers))
        means = np.stack([np.bincount(nearest, weights * colors[:, c], len(centers)) for c in range(3)], axis=1)
        centers = np.where(total[:, None] > 0, means / np.maximum(total, 1e-9)[:, None], centers)
    places = _nearest(colors, centers)[which].reshape(frames.shape[:3])
    return centers.round().astype(np.uint8), places.astype(np.uint8)


def _nearest(colors: np.ndarray, centers: np.ndarray) -> Int[np.ndarray, "n"]:
    square = (centers**2).sum(axis=1) - 2 * colors @ centers.T
    return square.argmin(axis=1)


def _packed(picture: UInt8[np.ndarray, "h w"]) -> bytes:
    """Rows without a filter, as they suit a palette."""
    return zlib.compress(b"".join(b"\0" + row.tobytes() for row in picture), 9)


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
