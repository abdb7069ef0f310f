"""Reads the file of one episode, and checks its arrays against the environment and the number of steps."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
from gymnasium.spaces import Box, Dict
from numpy.lib import format as npy

from mmp_env.errors import MmpError, UnknownNameError, in_words, is_out_of_memory
from mmp_env.files.reading import named
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.wording import shown

MAX_EPISODE_BYTES = 2**28
"""Largest size of the arrays of one episode: more than an hour of eight arms."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """The type, shape and numbers that an array of an episode may have.

    Attributes:
        dtype: type of the numbers.
        shape: shape of one row.
        low: least numbers of a row, one for all or of its shape.
        high: largest numbers of a row.
        extra: number of rows minus number of steps.
    """

    dtype: np.dtype
    shape: tuple[int, ...] = ()
    low: float | np.ndarray = -math.inf
    high: float | np.ndarray = math.inf
    extra: int = 0


def rows_of(env: MultiArmCellEnv) -> dict[str, Rows]:
    """Returns name -> what this array of an episode of an environment may hold, for all arrays that an episode has."""
    observed, acted = cast(Dict, env.observation_space), cast(Box, env.action_space)
    boxes = {f"observations.{name}": cast(Box, box) for name, box in observed.items()}
    out = {name: _rows_in(box, extra=1) for name, box in boxes.items()} | {"actions": _rows_in(acted)}
    truth, real = np.dtype(bool), np.dtype(float)
    return out | {
        "rewards": Rows(dtype=real),
        "terminations": Rows(dtype=truth),
        "truncations": Rows(dtype=truth),
        "infos.is_success": Rows(dtype=truth),
        "infos.distance_rad": Rows(dtype=real, low=0.0),
        "infos.contacts": Rows(dtype=np.dtype(int), low=0.0, high=0.0),
    }


def _rows_in(box: Box, extra: int = 0) -> Rows:
    return Rows(dtype=np.dtype(box.dtype), shape=box.shape, low=box.low, high=box.high, extra=extra)


def read_episode(path: Path, steps: int, allowed: Mapping[str, Rows]) -> dict[str, np.ndarray]:
    """Returns name -> array of an episode.

    Args:
        path: the file.
        steps: number of steps in the index of the dataset.
        allowed: name -> what the array may hold.

    Raises:
        MmpError: for a file that cannot be read, and for arrays that are missing, unknown, or hold something else.
    """
    with named(str(path)):
        try:
            with path.open("rb") as file:
                if file.read(2) != b"PK":  # `np.load` reads no archive behind other bytes
                    raise MmpError("it is not an episode of a dataset, which is an archive that begins with 'PK'")
                with zipfile.ZipFile(file) as archive:
                    _check_names(archive, allowed)
                    arrays = {name: _array(archive, name, steps, rows) for name, rows in allowed.items()}
        except MmpError:
            raise
        except Exception as error:  # the reader of a damaged file may raise anything
            if is_out_of_memory(error):
                raise
            raise MmpError(f"it is not an episode of a dataset ({in_words(error)})") from None
        if np.flatnonzero(arrays["terminations"]).tolist() != [steps - 1] or arrays["truncations"].any():
            raise MmpError("'terminations' must be true at the last step alone, and 'truncations' at no step")
        if not arrays["infos.is_success"][-1]:
            raise MmpError("'infos.is_success' must be true at the last step")
    return arrays


def _check_names(archive: zipfile.ZipFile, allowed: Mapping[str, Rows]) -> None:
    names = [name.removesuffix(".npy") for name in archive.namelist()]
    for name in names:
        if name not in allowed:
            raise UnknownNameError("array", shown(name)[1:-1], allowed)
    for name in allowed:
        if (count := names.count(name)) != 1:
            raise MmpError(f"it has {'two arrays' if count else 'no array'} '{name}'; an episode has one")
    size = sum(member.file_size for member in archive.infolist())
    if size > MAX_EPISODE_BYTES:
        raise MmpError(f"its arrays have {size / 2**20:.0f} MB; at most {MAX_EPISODE_BYTES / 2**20:g} MB are read")


def _array(archive: zipfile.ZipFile, name: str, steps: int, rows: Rows) -> np.ndarray:
    """Returns an array, which is read only if its type and shape are right. Raises `MmpError`."""
    with archive.open(f"{name}.npy") as file:
        if (version := npy.read_magic(file)) != (1, 0):
            raise MmpError(f"array '{name}' is a file of NumPy of version {version}; it must be (1, 0)")
        shape, is_fortran, dtype = npy.read_array_header_1_0(file)
        if dtype != rows.dtype:
            raise MmpError(f"array '{name}' is of type {shown(str(dtype))}; it must be '{rows.dtype}'")
        if shape != (wanted := (steps + rows.extra, *rows.shape)):
            raise MmpError(f"array '{name}' has shape {shown(shape)}; for {steps} steps it must be {wanted}")
        size = math.prod(shape) * dtype.itemsize
        content = file.read(size + 1)  # beyond its end, where the checksum is compared
    if len(content) != size:
        raise MmpError(f"array '{name}' has other numbers than its shape {shape} says")
    array = np.frombuffer(content, dtype).reshape(shape, order="F" if is_fortran else "C")
    is_good = np.isfinite(array) & (rows.low <= array) & (array <= rows.high)
    if not is_good.all():
        at = tuple(np.argwhere(~is_good)[0].tolist())
        low, high = (np.broadcast_to(bound, shape)[at] for bound in (rows.low, rows.high))
        allowed = "a finite number" + (f" from {low:g} to {high:g}" if low > -math.inf else "")
        raise MmpError(f"array '{name}' has {array[at]:g} at {list(at)}; it must be {allowed}")
    return array
