"""The convex pieces of mesh obstacles, as cells have them or of a mesh file.

The pieces of a file are kept in the user's cache folder, by its content.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists
from mmp_env.files.regular_files import read_bytes
from mmp_env.files.writing import json_text, whole_file
from mmp_env.model.arm import LARGEST_M, MOST_PIECES, MOST_VERTICES, SMALLEST_M
from mmp_env.model.convex_hull import thickness
from mmp_env.robot_folders import mesh_cache_folder
from mmp_env.wording import shown

Pieces = tuple[Float[np.ndarray, "_ 3"], ...]

LEAST_VERTICES = 4
"""Fewest vertices of a convex piece."""
VERSION = 1
"""Version of the decomposition. The cache holds results of the same version only."""
SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb")
"""Suffixes of mesh files."""
MAX_MESH_BYTES = 256 * 2**20
"""Largest mesh file that is read."""
SMALLEST_SCALE, LARGEST_SCALE = 1e-6, 1e6
"""Bounds of the absolute values of a scale."""


def checked_pieces(data: Sequence[ArrayLike], place: object) -> Pieces:
    """Returns the pieces in a cell. Raises `MmpError` where there are too many, or one is flat or too large."""
    if not 1 <= len(data) <= MOST_PIECES:
        raise MmpError(f"{place} has {len(data)} entries; a mesh has 1 to {MOST_PIECES} convex pieces")
    pieces = _arrays(data)
    for k, vertices in enumerate(pieces):
        if not LEAST_VERTICES <= len(vertices) <= MOST_VERTICES:
            raise MmpError(
                f"{place}[{k}] has {len(vertices)} vertices; a piece has {LEAST_VERTICES} to {MOST_VERTICES}"
            )
        if not np.all(np.abs(vertices) <= LARGEST_M):
            raise MmpError(f"{place}[{k}] has a vertex beyond {LARGEST_M:g} m; all must lie nearer to the origin")
        if not thickness(vertices) >= SMALLEST_M:
            raise MmpError(f"{place}[{k}] is flat; a piece must be {SMALLEST_M} m thick at least")
    return pieces


def read_pieces(path: Path, scale: ArrayLike = 1.0) -> Pieces:
    """Returns the convex pieces [m] of a mesh file, whose vertices are multiplied by `scale`.

    Raises:
        MmpError: if the scale is not one or three numbers that are not 0, or the file is no mesh with a volume.
    """
    factors = _factors(scale)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise MmpError(f"{path} has the suffix {shown(suffix)}; a mesh file has one of {', '.join(SUFFIXES)}")
    if not exists(path):
        raise MmpError(f"mesh file {path} does not exist")
    content = read_bytes(path, MAX_MESH_BYTES, "mesh")
    said = json.dumps([VERSION, hashlib.sha256(content).hexdigest(), suffix, factors.tolist()])
    kept = mesh_cache_folder() / f"{hashlib.sha256(said.encode()).hexdigest()[:40]}.json"
    with suppress(OSError, ValueError, MmpError):
        return checked_pieces(json.loads(kept.read_text(encoding="utf-8")), kept)
    pieces = _decomposed(path, content, factors)
    with suppress(OSError, MmpError):  # the cache is a convenience
        kept.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(kept) as temporary:
            temporary.write_text(json_text([piece.tolist() for piece in pieces]), encoding="utf-8")
    return pieces


def _decomposed(path: Path, content: bytes, factors: Float[np.ndarray, "3"]) -> Pieces:
    from mmp_env.meshes.mesh_files import parse_mesh
    from mmp_env.meshes.mesh_pieces import mesh_pieces

    vertices, faces = parse_mesh(path, content)
    if np.prod(factors) < 0:  # a mirrored mesh is inside out
        faces = faces[:, ::-1]
    vertices = vertices * factors
    largest = float(np.abs(vertices).max())
    if largest > LARGEST_M:
        raise MmpError(
            f"mesh file {path} reaches {largest:g} m from its origin; {LARGEST_M:g} m is the most."
            " A file in millimetres needs the scale 0.001"
        )
    try:
        pieces = mesh_pieces(vertices, faces)
    except MmpError as error:
        raise MmpError(f"mesh file {path} {error}") from None
    return checked_pieces(pieces, f"the decomposition of mesh file {path}")


def _factors(scale: ArrayLike) -> Float[np.ndarray, "3"]:
    factors = np.asarray(np.nan if scale is None else as_numbers(scale), dtype=float)
    if factors.shape in ((), (1,), (3,)):
        size = np.abs(factors)
        if ((size >= SMALLEST_SCALE) & (size <= LARGEST_SCALE)).all():
            return np.broadcast_to(factors, 3).copy()
    allowed = f"one number or three, each from {SMALLEST_SCALE} to {LARGEST_SCALE:g} or the negative of that"
    raise MmpError(f"scale is {shown(scale)}; it must be {allowed}")


def _arrays(pieces: Sequence[ArrayLike]) -> Pieces:
    out = tuple(np.array(piece, dtype=float).reshape(-1, 3) for piece in pieces)
    for piece in out:
        piece.setflags(write=False)
    return out
