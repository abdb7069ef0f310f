"""Polytopes of few vertices around convex hulls of meshes, which the cache keeps by content."""

from __future__ import annotations

import hashlib
import json

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.files.paths import exists
from mmp_env.files.temporaries import beside
from mmp_env.meshes.mesh_pieces import outer_hull
from mmp_env.model.arm import MOST_VERTICES
from mmp_env.robot_folders import cache_folder

_VERSION = 2


def mesh_outline(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "v 3"]:
    """Returns the vertices of a polytope that contains the hull of points [m], see `outer_hull`.

    Raises:
        MmpError: if the points lie in a plane, or the polytope has too many vertices for a file.
    """
    key = hashlib.sha256(b"%d" % _VERSION + np.ascontiguousarray(points, dtype=float).tobytes()).hexdigest()[:40]
    file = cache_folder() / "outlines" / f"{key}.json"
    if exists(file):
        return np.array(json.loads(file.read_text(encoding="utf-8")))
    vertices = outer_hull(points)
    if len(vertices) > MOST_VERTICES:
        raise MmpError(
            f"its outline has {len(vertices)} vertices; a piece has at most {MOST_VERTICES}; simplify the mesh"
        )
    file.parent.mkdir(parents=True, exist_ok=True)
    with beside(file) as new:
        new.write_text(json.dumps(vertices.tolist()), encoding="utf-8")
        new.replace(file)
    return vertices
