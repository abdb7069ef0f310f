"""The distance of two convex geoms by the algorithm of Gilbert, Johnson and Keerthi.

It takes over where MuJoCo is wrong: MuJoCo reports a capsule that sticks out of a box on both sides as clear of it.
E. G. Gilbert, D. W. Johnson, S. S. Keerthi: A fast procedure for computing the distance between complex objects in
three-dimensional space. IEEE Journal of Robotics and Automation 4 (2), 1988.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from operator import itemgetter

import numpy as np
from jaxtyping import Float

from mmp_env.check.distance import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE
from mmp_env.check.hulls import GrownMesh

_EXACT_M = 1e-10
_MOST_ROUNDS = 100
_PARALLEL = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Convex:
    """A placed geom with MuJoCo's `kind` and `size` [m]: everything within `round` [m] of its core."""

    kind: int
    size: Float[np.ndarray, "3"]
    center: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    mesh: GrownMesh | None = None

    @property
    def round(self) -> float:
        """Radius [m] around the core; above 0 for a grown mesh, and for a sphere or capsule around a point or line."""
        if self.mesh is not None:
            return self.mesh.radius
        return float(self.size[0]) if self.kind in (SPHERE, CAPSULE) else 0.0

    def farthest(self, direction: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """Returns the point [m] of the core that lies farthest along a direction of any length."""
        local, size = direction @ self.rotation, self.size
        if self.mesh is not None:
            corners = self.mesh.vertices
            return self.center + self.rotation @ corners[np.argmax(corners @ local)]
        sign = np.where(local < 0, -1.0, 1.0)
        out = np.zeros(3)
        if self.kind == CAPSULE:
            out[2] = sign[2] * size[1]
        elif self.kind == BOX:
            out = sign * size
        elif self.kind == CYLINDER:
            radial = np.hypot(local[0], local[1])
            out[:2] = size[0] * local[:2] / radial if radial > 0 else 0.0
            out[2] = sign[2] * size[1]
        elif self.kind == ELLIPSOID:
            out = size * (size * local) / max(np.linalg.norm(size * local), np.finfo(float).tiny)
        return self.center + self.rotation @ out


def separation(first: Convex, second: Convex) -> tuple[float, Float[np.ndarray, "3"]]:
    """Returns the signed distance [m] of two geoms, and the unit direction from the first to the second that shows it.

    The distance of geoms that overlap is minus their depth. If their cores overlap, it is the least depth along the
    axes of the geoms and the normals of two axes. That is exact for boxes; other geoms may be less deep.
    """
    # The differences of their points form a convex set; `corners` span a part of it, with `nearest` to the origin.
    nearest = second.center - first.center
    corners, best = nearest[None], (-np.inf, nearest)
    for _ in range(_MOST_ROUNDS):
        length = float(np.linalg.norm(nearest))
        if length < _EXACT_M:
            return max(((_gap(first, second, n), n) for n in _axes(first, second)), key=itemgetter(0))
        along = nearest / length
        corner = second.farthest(-along) - first.farthest(along)
        best = max(best, (float(corner @ along), along), key=itemgetter(0))
        if length - best[0] < _EXACT_M:
            break
        nearest, corners = _nearest_to_origin(np.vstack([corners, corner]))
    return best[0] - first.round - second.round, best[1]


def _gap(first: Convex, second: Convex, along: Float[np.ndarray, "3"]) -> float:
    """Returns the gap [m] that a unit direction shows between two geoms."""
    apart = float((second.farthest(-along) - first.farthest(along)) @ along)
    return apart - first.round - second.round


def _axes(first: Convex, second: Convex) -> Iterator[Float[np.ndarray, "3"]]:
    """Yields unit directions and their opposites: the axes of both geoms, and the normals of one axis of each."""
    own = [*first.rotation.T, *second.rotation.T]
    for axis in [*own, *(np.cross(one, other) for one in own[:3] for other in own[3:])]:
        length = np.linalg.norm(axis)
        if length > _PARALLEL:
            yield axis / length
            yield -axis / length


def _nearest_to_origin(corners: Float[np.ndarray, "k 3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "c 3"]]:
    """Returns the point of a simplex of up to four corners nearest to the origin, and the corners that span it.

    The last corner is new, and one of these.
    """
    last, others = corners[-1], corners[:-1]
    nearest, between = last, corners[-1:]
    for count in range(1, len(corners)):
        for chosen in combinations(others, count):
            edges = np.array(chosen) - last
            shares = np.linalg.lstsq(edges.T, -last)[0]
            point = last + shares @ edges
            if (shares >= 0).all() and shares.sum() <= 1 and point @ point < nearest @ nearest:
                nearest, between = point, np.vstack([chosen, last])
    return nearest, between
