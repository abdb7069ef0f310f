"""Reads mesh files that MuJoCo cannot read, with trimesh."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError, in_words

_MUJOCO_SUFFIXES = (".stl", ".obj", ".msh")


def is_read_by_mujoco(path: Path) -> bool:
    """Returns whether MuJoCo reads mesh files of this suffix."""
    return path.suffix.lower() in _MUJOCO_SUFFIXES


def require(module: str) -> Any:
    """Returns a module of the extra `robots`. Raises `MmpError` where it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MmpError(f"importing robots needs {module}: pip install 'mmp-env[robots]'") from None


def read_mesh(path: Path) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Returns vertices [m] and triangles of a mesh file. Raises `MmpError`."""
    trimesh = require("trimesh")
    try:
        mesh = trimesh.load(str(path), force="mesh")
        vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32)
    except Exception as error:  # readers of many formats, which raise anything
        raise MmpError(f"mesh file {path} cannot be read ({in_words(error)}); convert it to STL or OBJ") from None
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise MmpError(f"mesh file {path} holds no triangles; convert it to STL or OBJ")
    return vertices, faces
