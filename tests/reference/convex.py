"""Distance of two convex hulls of few vertices [m], from all vertices, edges and triangles."""

from itertools import combinations

import numpy as np


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
