"""Which balls are near which points, found by halving the points: a group of points needs few of many balls."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Bool, Float, Int

_FEW_POINTS = 64
_SMALL = 2**14
"""Number of pairs of a point and a ball up to which a group is not halved."""
_ROUNDING_M = 1e-9

Points = Float[np.ndarray, "n 3"]
Centers = Float[np.ndarray, "s 3"]
Radii = Float[np.ndarray, "s"]


def deepest_ball(points: Points, centers: Centers, radii: Radii) -> tuple[Int[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Returns the ball in which each point lies deepest, and how far [m] the point is outside it."""
    ball, outside = np.zeros(len(points), dtype=int), np.full(len(points), np.inf)
    # The distance to a ball changes at most as much as the point moves.
    for rows, near in _groups(points, centers, radii, lambda away, reach: away <= away.min() + 2 * reach):
        away = _distances(points[rows], centers[near]) - radii[near]
        best = away.argmin(axis=1)
        ball[rows], outside[rows] = near[best], away[np.arange(len(rows)), best]
    return ball, outside


def points_in_balls(
    points: Points, depth: Float[np.ndarray, "n"], centers: Centers, radii: Radii
) -> tuple[Int[np.ndarray, "m"], Int[np.ndarray, "m"]]:
    """Returns which points lie at least `depth` [m] deep in which balls: numbers of both, in ascending order."""
    found_rows, found_balls = [np.empty(0, dtype=np.int32)], [np.empty(0, dtype=np.int32)]
    least = float(depth.min(initial=0.0))
    for rows, near in _groups(points, centers, radii, lambda away, reach: away <= reach - least):
        row, column = np.nonzero(_distances(points[rows], centers[near]) + depth[rows, None] <= radii[near])
        found_rows.append(rows[row].astype(np.int32))
        found_balls.append(near[column].astype(np.int32))
    rows, balls = np.concatenate(found_rows), np.concatenate(found_balls)
    order = np.lexsort((balls, rows))
    return rows[order], balls[order]


def _groups(
    points: Points,
    centers: Centers,
    radii: Radii,
    is_near: Callable[[Float[np.ndarray, "k"], float], Bool[np.ndarray, "k"]],
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields numbers of points near each other and of all balls that may matter to them.

    `is_near` is asked with the distances of balls from the middle of a group, and the reach of the group from there.
    """
    groups = [(np.arange(len(points)), np.arange(len(radii)))] if len(points) and len(radii) else []
    while groups:
        rows, balls = groups.pop()
        own = points[rows]
        low, high = own.min(axis=0), own.max(axis=0)
        away = _distances(((low + high) / 2)[None], centers[balls])[0] - radii[balls]
        balls = balls[is_near(away, float(np.linalg.norm(high - low)) / 2 + _ROUNDING_M)]
        if len(rows) <= _FEW_POINTS or len(rows) * len(balls) <= _SMALL:
            yield rows, balls
            continue
        middle = len(rows) // 2
        order = np.argpartition(own[:, (high - low).argmax()], middle)
        groups += [(rows[order[middle:]], balls), (rows[order[:middle]], balls)]


def _distances(points: Points, centers: Centers) -> Float[np.ndarray, "n s"]:
    out = np.zeros((len(points), len(centers)))
    for k in range(3):
        difference = points[:, k, None] - centers[:, k]
        out += difference * difference
    return np.sqrt(out, out=out)
