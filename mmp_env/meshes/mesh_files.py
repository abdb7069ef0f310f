"""Reads mesh files with trimesh."""

from __future__ import annotations

import importlib
import io
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError
from mmp_env.wording import shown

MOST_TRIANGLES = 2_000_000
"""Largest number of triangles of a mesh."""
_TYPES_OF_EXTRA = ("dae", "zae")
_MUJOCO_SUFFIXES = (".stl", ".obj", ".msh")


def is_read_by_mujoco(path: Path) -> bool:
    """Returns whether MuJoCo reads mesh files of this suffix."""
    return path.suffix.lower() in _MUJOCO_SUFFIXES


def refuse_words(path: Path, content: bytes) -> None:
    """Raises `MmpError` for a vertex of an OBJ file that is not three finite numbers. MuJoCo reads words as 0."""
    for number, row in enumerate(content.splitlines(), 1):
        words = row.split()
        if words[:1] == [b"v"] and not (len(words) >= 4 and all(map(_is_number, words[1:4]))):
            raise MmpError(
                f"mesh file {path} line {number}: {shown(row.decode(errors='replace'))} is no vertex;"
                " it must have three finite numbers"
            )


def _is_number(word: bytes) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def require(module: str) -> Any:
    """Returns a module of the extra `robots`. Raises `MmpError` where it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MmpError(f"reading robots and meshes needs {module}: pip install 'mmp-env[robots]'") from None


def read_mesh(path: Path) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Returns vertices [m] and triangles of a mesh file, in metres if it names no unit. Raises `MmpError`."""
    return _parsed(path, str(path))


def parse_mesh(path: Path, content: bytes) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Returns vertices [m] and triangles of the content of a mesh file, and reads no other file. Raises `MmpError`."""
    return _parsed(path, io.BytesIO(content), file_type=path.suffix.lower().removeprefix("."))


def _parsed(path: Path, source: Any, **options: Any) -> tuple[np.ndarray, np.ndarray]:
    trimesh = require("trimesh")
    kind = path.suffix.lower().removeprefix(".")
    if kind not in {*trimesh.available_formats(), *_TYPES_OF_EXTRA}:
        raise MmpError(f"mesh file {path} cannot be read: its type '.{kind}' is unknown; convert it to STL or OBJ")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = trimesh.load(source, force="mesh", **options)
        metres = 1.0 if mesh.units is None else trimesh.units.unit_conversion(mesh.units, "meters")
        vertices, faces = np.asarray(mesh.vertices, float) * metres, np.asarray(mesh.faces, np.int32)
    except (ImportError, NotImplementedError):
        raise MmpError(
            f"reading mesh files of type '.{kind}' such as {path} needs a package: pip install 'mmp-env[robots]';"
            " or convert them to STL or OBJ"
        ) from None
    except Exception:  # readers of many formats, which raise anything
        raise MmpError(f"mesh file {path} is no valid .{kind} file; convert it to STL or OBJ") from None
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise MmpError(f"mesh file {path} holds no triangles; convert it to STL or OBJ")
    if len(faces) > MOST_TRIANGLES:
        raise MmpError(f"mesh file {path} has {len(faces)} triangles; simplify it to {MOST_TRIANGLES} at most")
    return vertices, faces
