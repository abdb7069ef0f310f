"""Polytopes of few vertices around convex hulls of meshes, which the cache keeps by content."""

from __future__ import annotations

import hashlib
import json

import numpy as np
from jaxtyping import Float

from mmp_env.files.paths import exists
from mmp_env.files.temporaries import beside
from mmp_env.importing.pieces import mesh_piece
from mmp_env.robot_folders import cache_folder

_VERSION = 1


def mesh_outline(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "v 3"]:
    """Returns the vertices of a polytope that contains the hull of points [m] and protrudes by less than 1 mm.

    Raises:
        MmpError: if the points lie in a plane.
    """
    key = hashlib.sha256(b"%d" % _VERSION + np.ascontiguousarray(points, dtype=float).tobytes()).hexdigest()[:40]
    file = cache_folder() / "outlines" / f"{key}.json"
    if exists(file):
        return np.array(json.loads(file.read_text(encoding="utf-8")))
    vertices = mesh_piece(points).outline().vertices
    file.parent.mkdir(parents=True, exist_ok=True)
    with beside(file) as new:
        new.write_text(json.dumps(vertices.tolist()), encoding="utf-8")
        new.replace(file)
    return vertices
