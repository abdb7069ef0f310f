"""Distances of convex hulls [m]: from all vertices, edges and triangles, or by least squares."""

from itertools import combinations

import numpy as np
from scipy.optimize import nnls


def hull_distance(a, b):
    """Returns the distance between the hulls of points a [n, 3] and b [m, 3], which must not overlap.

    A triangle of any three points lies in the hull, so none is closer than the hulls are; the nearest points lie on a
    vertex and a face, or on two edges.
    """
    edges = min(segment_distance(*p, *q) for p in pairs(a) for q in pairs(b))
    faces = min(
        triangle_distance(point, *corners) for x, y in ((a, b), (b, a)) for point in x for corners in triples(y)
    )
    return min(edges, faces)


def pairs(points):
    """Returns all pairs of points, of a single point that point twice."""
    return list(combinations(points, 2)) or [(points[0], points[0])]


def triples(points):
    """Returns all triples of points, filled up by the last one."""
    few = [*points, *points[-1:], *points[-1:]] if len(points) < 3 else points
    return list(combinations(few, 3))


def segment_distance(p, q, r, s):
    """Returns the distance between segments pq and rs: inside both lines, or at an end of one."""
    ends = [point_to_segment(x, r, s) for x in (p, q)] + [point_to_segment(x, p, q) for x in (r, s)]
    d, e = q - p, s - r
    system = np.array([[d @ d, -d @ e], [d @ e, -e @ e]])
    if abs(np.linalg.det(system)) > 1e-14:
        t, u = np.linalg.solve(system, [d @ (r - p), e @ (r - p)])
        if 0 <= t <= 1 and 0 <= u <= 1:
            ends.append(np.linalg.norm(p + t * d - r - u * e))
    return min(ends)


def point_to_segment(x, p, q):
    """Returns the distance of a point from a segment."""
    d = q - p
    t = np.clip((x - p) @ d / max(d @ d, 1e-300), 0, 1)
    return np.linalg.norm(x - p - t * d)


def triangle_distance(x, p, q, r):
    """Returns the distance of a point from a triangle: its plane if the foot is inside, or else its edges."""
    normal = np.cross(q - p, r - p)
    edges = [point_to_segment(x, *edge) for edge in ((p, q), (q, r), (r, p))]
    if normal @ normal > 1e-20:
        inside = [np.cross(t - s, x - s) @ normal >= 0 for s, t in ((p, q), (q, r), (r, p))]
        if all(inside):
            edges.append(abs((x - p) @ normal) / np.linalg.norm(normal))
    return min(edges)


def distance_from_hull_to_origin(points):
    """Returns the distance of the origin from the hull of points [n, 3]; 0 inside.

    Least squares with weights x >= 0 of |sum x p|^2 + (1 - sum x)^2: for any sum, the best weights give the point of
    the hull that is closest to the origin (Lawson and Hanson, Solving Least Squares Problems, chapter 23).
    """
    weights, _ = nnls(np.vstack([points.T, np.ones(len(points))]), np.array([0.0, 0.0, 0.0, 1.0]))
    return float(np.linalg.norm(points.T @ (weights / weights.sum())))


def swept_vertices(hulls, ends, t, placed):
    """Returns the vertices of each hull at time t of 0 to 1, when all move straight from the first to the second end.

    `ends` has two rows of one pose per hull. `placed(vertices, pose)` returns vertices in the world.
    """
    start, end = ends
    return [(1 - t) * placed(v, p) + t * placed(v, q) for v, p, q in zip(hulls, start, end, strict=True)]
