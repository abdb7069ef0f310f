"""Reads mesh files with trimesh."""

from __future__ import annotations

import importlib
import io
import math
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float, Int

from mmp_env.errors import MmpError
from mmp_env.wording import shown

MOST_TRIANGLES = 2_000_000
"""Largest number of triangles of a mesh."""
_MOST_INDEX = 2**31 - 1
_TYPES_OF_EXTRA = ("dae", "zae")
_MUJOCO_SUFFIXES = (".stl", ".obj", ".msh")


def is_read_by_mujoco(path: Path) -> bool:
    """Returns whether MuJoCo reads mesh files of this suffix."""
    return path.suffix.lower() in _MUJOCO_SUFFIXES


def refuse_words(path: Path, content: bytes) -> None:
    """Raises `MmpError` for a vertex of an OBJ or COLLADA file that is not three finite numbers, and for a wrong index.

    MuJoCo reads words as 0, pycollada reads NaN as 0, and both read indices above 32 bits as other ones.
    """
    if path.suffix.lower() == ".obj":
        _refuse_words_of_obj(path, content)
    elif path.suffix.lower() == ".dae":
        _refuse_words_of_collada(path, content)


def _refuse_words_of_obj(path: Path, content: bytes) -> None:
    rows = [row.split() for row in content.splitlines()]
    count = sum(words[:1] == [b"v"] for words in rows)
    for number, words in enumerate(rows, 1):
        if words[:1] == [b"v"] and not (len(words) >= 4 and all(map(_is_number, words[1:4]))):
            wanted = "is no vertex; it must have three finite numbers"
        elif words[:1] == [b"f"] and not all(_is_vertex_of_obj(word, count) for word in words[1:]):
            wanted = f"is no triangle; the numbers of its vertices must be 1 to {count}, or -{count} to -1"
        else:
            continue
        row = b" ".join(words).decode(errors="replace")
        raise MmpError(f"mesh file {path} line {number}: {shown(row)} {wanted}")


def _refuse_words_of_collada(path: Path, content: bytes) -> None:
    try:
        elements = list(ElementTree.fromstring(content).iter())
    except (ElementTree.ParseError, LookupError, ValueError):
        raise MmpError(f"mesh file {path} is no valid .dae file; convert it to STL or OBJ") from None
    inputs = [element for element in elements if _tag(element) == "input" and element.get("semantic") == "POSITION"]
    places = {element.get("source", "").removeprefix("#") for element in inputs}
    for element in elements:
        if _tag(element) == "source" and element.get("id") in places:
            words = [word for each in element if _tag(each) == "float_array" for word in (each.text or "").split()]
            if (word := next((word for word in words if not _is_number(word)), None)) is not None:
                raise MmpError(f"mesh file {path}: {shown(word)} is no coordinate of a vertex; it must be finite")
        if _tag(element) == "p":
            words = (element.text or "").split()
            if (word := next((word for word in words if not _is_index(word)), None)) is not None:
                raise MmpError(
                    f"mesh file {path}: {shown(word)} is no index; it must be a whole number from 0 to {_MOST_INDEX}"
                )


def _is_vertex_of_obj(word: bytes, count: int) -> bool:
    digits = word.split(b"/")[0].removeprefix(b"-")
    return digits.isdigit() and len(digits) <= len(str(_MOST_INDEX)) and 1 <= int(digits) <= count


def _tag(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _is_index(word: str) -> bool:
    return word.isdecimal() and len(word) <= len(str(_MOST_INDEX)) and int(word) <= _MOST_INDEX


def _is_number(word: bytes | str) -> bool:
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
    refuse_words(path, content)
    return _parsed(path, io.BytesIO(content), file_type=path.suffix.lower().removeprefix("."))


def _parsed(path: Path, source: Any, **options: Any) -> tuple[np.ndarray, np.ndarray]:
    trimesh = require("trimesh")
    kind = path.suffix.lower().removeprefix(".")
    if kind not in {*trimesh.available_formats(), *_TYPES_OF_EXTRA}:
        raise MmpError(f"mesh file {path} cannot be read: its type '.{kind}' is unknown; convert it to STL or OBJ")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # As it is in the file: otherwise trimesh leaves out triangles whose vertices are not finite.
            mesh = trimesh.load(source, force="mesh", process=False, **options)
        metres = 1.0 if mesh.units is None else trimesh.units.unit_conversion(mesh.units, "meters")
        vertices = np.asarray(mesh.vertices, float).reshape(len(mesh.vertices), 3) * metres
        faces = np.asarray(mesh.faces)
    except (ImportError, NotImplementedError):
        raise MmpError(
            f"reading mesh files of type '.{kind}' such as {path} needs a package: pip install 'mmp-env[robots]';"
            " or convert them to STL or OBJ"
        ) from None
    except Exception:  # readers of many formats, which raise anything
        raise MmpError(f"mesh file {path} is no valid .{kind} file; convert it to STL or OBJ") from None
    _check(path, vertices, faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about vertices far away, which the callers refuse
        mesh.merge_vertices()
    faces = np.asarray(mesh.faces, np.int32)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]  # without those that became edges
    if len(faces) == 0:
        raise MmpError(f"mesh file {path} holds no triangles; convert it to STL or OBJ")
    return np.asarray(mesh.vertices, float) * metres, faces


def _check(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Raises `MmpError` for vertices that are not finite, and for triangles that are too many or have no vertices."""
    if len(faces) == 0:
        raise MmpError(f"mesh file {path} holds no triangles; convert it to STL or OBJ")
    if len(faces) > MOST_TRIANGLES:
        raise MmpError(f"mesh file {path} has {len(faces)} triangles; simplify it to {MOST_TRIANGLES} at most")
    if not np.isfinite(vertices).all():
        raise MmpError(f"mesh file {path} has a vertex that is not finite; every vertex must have three finite numbers")
    unknown = faces[(faces < 0) | (faces >= len(vertices))]
    if len(unknown):
        raise MmpError(
            f"mesh file {path} has a triangle with vertex {unknown[0]};"
            f" its {len(vertices)} vertices have the numbers 0 to {len(vertices) - 1}"
        )
