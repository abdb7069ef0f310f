"""The rule of rest: an object stays where it lies if something flat is below its centre.

The checker samples directions and edges, where the planners clip polygons.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from jaxtyping import Bool, Float

from mmp_env.check.checked import Solid
from mmp_env.check.fields import rotation

SUPPORT_TOLERANCE_M = 2e-3
"""Largest gap, and largest overlap, of an object and what it lies on [m]."""
FLAT_M = 1e-3
"""Largest difference in height of the corners of an underside or of a top [m]."""
BALANCE_M = 2e-3
"""Largest distance of an object's centre from the area that carries it, seen from above [m]."""
_DIRECTIONS = np.stack([np.cos(np.linspace(0, 2 * np.pi, 721)), np.sin(np.linspace(0, 2 * np.pi, 721))])
_ON_EDGE = 100
"""Number of points on each edge."""
_SIDES = 32
"""Number of corners that stand for the rim of a cylinder."""


def carriers(solid: Solid, others: Sequence[Solid]) -> list[str]:
    """Returns the names of the solids that carry an object; none if it would fall."""
    bottom = _level(solid, -1.0)
    found: dict[str, Float[np.ndarray, "k 2"]] = {}
    for other in others:
        top = _level(other, 1.0)
        if abs(bottom[:, 2].min() - top[:, 2].max()) > SUPPORT_TOLERANCE_M or len(top) < 3:
            continue
        both = [(bottom[:, :2], top[:, :2]), (top[:, :2], bottom[:, :2])]
        shared = np.concatenate([edge[_within(edge, area, 1e-6)] for ring, area in both for edge in [_outline(ring)]])
        if len(shared):
            found[other.name] = np.concatenate([found.get(other.name, np.zeros((0, 2))), shared])
    if not found or not _within(solid.position[None, :2], np.concatenate(list(found.values())), BALANCE_M)[0]:
        return []
    return list(found)


def corners(solid: Solid) -> tuple[Float[np.ndarray, "k 3"], float]:
    """Returns points [m] in the frame of the pose of a solid, and the radius of balls [m] around their hull."""
    radius, half = float(solid.size[0]), float(solid.size[1])
    if solid.vertices is not None:
        points, grown = solid.vertices, 0.0
    elif solid.shape == "box":
        points, grown = np.array(list(product((-1.0, 1.0), repeat=3))) * solid.size, 0.0
    elif solid.shape == "cylinder":
        angle = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False)
        rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        points, grown = np.concatenate([np.insert(rim, 2, z, axis=1) for z in (-half, half)]), 0.0
    else:
        points, grown = (
            np.array([[0.0, 0.0, z] for z in ((0.0,) if solid.shape == "sphere" else (-half, half))]),
            radius,
        )
    return points @ rotation(solid.quaternion).T + solid.position, grown


def _level(solid: Solid, side: float) -> Float[np.ndarray, "k 3"]:
    """Returns the highest (1) or lowest (-1) corners of a solid [m]."""
    points, grown = corners(solid)
    points = points + np.array([0.0, 0.0, side * grown])
    heights = side * points[:, 2]
    return points[heights >= heights.max() - FLAT_M]


def _outline(points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "n 2"]:
    """Returns points on the edges of a convex polygon, whose corners are given in any order."""
    off = points - points.mean(axis=0)
    ring = points[np.argsort(np.arctan2(off[:, 1], off[:, 0]), kind="stable")]
    share = np.linspace(0.0, 1.0, _ON_EDGE)[:, None, None]
    return (ring + share * (np.roll(ring, -1, axis=0) - ring)).reshape(-1, 2)


def _within(
    points: Float[np.ndarray, "n 2"], area: Float[np.ndarray, "k 2"], tolerance: float
) -> Bool[np.ndarray, "n"]:
    """Returns which points are within a distance [m] of the convex hull of others, in all sampled directions."""
    return (points @ _DIRECTIONS <= (area @ _DIRECTIONS).max(axis=0) + tolerance).all(axis=1)
