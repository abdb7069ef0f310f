"""Readers of all files that commands write, which find a file that is half written."""

from __future__ import annotations

import csv
import json
import struct
import xml.etree.ElementTree as ET
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import yaml
from PIL import Image


def broken(path: Path) -> str | None:
    """Returns why a file is not whole, or None."""
    if path.suffix not in READERS:
        return f"no reader for the suffix {path.suffix!r}"
    return _reason(READERS[path.suffix], path)


def _reason(read: Callable[[Path], object], path: Path) -> str | None:
    try:
        read(path)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def _rows(path: Path) -> None:
    """Reads the whole lines of a file that grows by lines; the last one may be without its end."""
    for row in path.read_bytes().split(b"\n")[:-1]:
        _require(isinstance(json.loads(row), dict), "a line that is no object")


def _csv(path: Path) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    _require(len(rows) > 1 and len({len(row) for row in rows}) == 1, "rows of several lengths")
    _require(path.read_bytes().endswith(b"\n"), "no end of the last line")


def _npz(path: Path) -> None:
    _require(zipfile.ZipFile(path).testzip() is None, "a member is damaged")
    with np.load(path) as arrays:
        for name in arrays.files:
            assert arrays[name] is not None


def _picture(path: Path) -> None:
    with Image.open(path) as picture:
        for frame in range(getattr(picture, "n_frames", 1)):
            picture.seek(frame)
            picture.load()


def _rrd(path: Path) -> None:
    _require(bool(recorded_rows(path)), "nothing in it")


def recorded_rows(path: Path) -> Counter[tuple[str, str]]:
    """Returns entity and component -> number of rows of a recording."""
    from rerun.chunk import RrdReader

    out = Counter[tuple[str, str]]()
    for chunk in RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        out.update({(chunk.entity_path, name): batch.num_rows for name in batch.schema.names if ":" in name})
    return out


def _mp4(path: Path) -> None:
    boxes = dict(_boxes(path.read_bytes()))
    _require(boxes.get(b"moov", 0) > 0 and boxes.get(b"mdat", 0) > 0, "no index or no data")


def _boxes(content: bytes) -> Iterator[tuple[bytes, int]]:
    """Yields type and size [bytes] of each box at the top of an MP4, which they fill."""
    at = 0
    while at < len(content):
        size, kind = struct.unpack_from(">I4s", content, at)
        begin = 16 if size == 1 else 8  # a large box has its size after its type
        size = struct.unpack_from(">Q", content, at + 8)[0] if size == 1 else size or len(content) - at
        _require(begin <= size <= len(content) - at, "a box that is cut off")
        yield kind, size - begin
        at += size


def _hdf5(path: Path) -> None:
    def read(_: str, item: h5py.Group | h5py.Dataset) -> None:  # anything but None would end the visit
        if isinstance(item, h5py.Dataset):
            item[()]

    with h5py.File(path) as file:
        file.visititems(read)


def _html(path: Path) -> None:
    _require(path.read_text(encoding="utf-8").rstrip().endswith("</html>"), "no end of the page")


def _markdown(path: Path) -> None:
    _require(path.read_text(encoding="utf-8").endswith("\n"), "no end of the last line")


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)


READERS: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")),
    ".jsonl": _rows,
    ".svg": ET.parse,
    ".xml": ET.parse,
    ".yaml": lambda path: _require(bool(yaml.safe_load(path.read_text(encoding="utf-8"))), "empty"),
    ".csv": _csv,
    ".npz": _npz,
    ".rrd": _rrd,
    ".mp4": _mp4,
    ".hdf5": _hdf5,
    ".html": _html,
    ".md": _markdown,
} | dict.fromkeys((".png", ".jpg", ".webp", ".gif"), _picture)
"""Suffix -> reader that fails for a file that is not whole."""
