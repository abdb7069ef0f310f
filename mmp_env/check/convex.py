"""How far two convex geoms are apart, from their farthest points alone (the algorithm of Gilbert, Johnson and Keerthi).

For where MuJoCo's answer proves nothing: it takes a capsule that sticks out of a box on both sides for clear of it.
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

_EXACT_M = 1e-10
_MOST_ROUNDS = 100
_PARALLEL = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Convex:
    """A placed geom, `kind` and `size` [m] as MuJoCo has them: all within `round` [m] of a core."""

    kind: int
    size: Float[np.ndarray, "3"]
    center: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]

    @property
    def round(self) -> float:
        """How far a sphere or capsule reaches beyond its core, a point or a line [m]."""
        return float(self.size[0]) if self.kind in (SPHERE, CAPSULE) else 0.0

    def farthest(self, direction: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """A point of the core that lies farthest along a direction, which need not be of length 1 [m]."""
        local, size = direction @ self.rotation, self.size
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
    """By how much a direction keeps two geoms apart at most [m], and that unit direction, from the first on.

    This is their distance. Of geoms that overlap it is the depth, negative; if their cores do as well, the least along
    the axes of the geoms and what is at right angles to two of them: exact for boxes, else the depth may be less.
    """
    # The differences of their points are a convex set: `nearest` to the origin is this of what `corners` of it span.
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
    """By how much a unit direction keeps two geoms apart [m]."""
    apart = float((second.farthest(-along) - first.farthest(along)) @ along)
    return apart - first.round - second.round


def _axes(first: Convex, second: Convex) -> Iterator[Float[np.ndarray, "3"]]:
    """Unit directions both ways: the axes of both geoms, and what is at right angles to one of each."""
    own = [*first.rotation.T, *second.rotation.T]
    for axis in [*own, *(np.cross(one, other) for one in own[:3] for other in own[3:])]:
        length = np.linalg.norm(axis)
        if length > _PARALLEL:
            yield axis / length
            yield -axis / length


def _nearest_to_origin(corners: Float[np.ndarray, "k 3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "c 3"]]:
    """Of the simplex of up to four corners the point nearest to the origin, and the corners that it lies between.

    The last corner, which is new, is one of those.
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
