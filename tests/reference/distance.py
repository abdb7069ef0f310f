"""Signed distance of points from a solid [m]: negative inside. `points` are [..., 3]."""

import numpy as np

from mmp_env.model.arm import Obstacle
from mmp_env.model.transforms import matrix_from_quaternion


def _from_excess(excess):
    """Returns the distance, given the signed distances from perpendicular walls [..., walls], negative inside."""
    outside = np.linalg.norm(np.maximum(excess, 0), axis=-1)
    inside = np.minimum(excess.max(axis=-1), 0)
    return outside + inside


def to_box(points, size):
    """Returns the distance from a box about the origin with full edge lengths `size`."""
    return _from_excess(np.abs(points) - np.asarray(size) / 2)


def to_sphere(points, radius):
    """Returns the distance from a sphere about the origin."""
    return np.linalg.norm(points, axis=-1) - radius


def to_cylinder(points, radius, length):
    """Returns the distance from a cylinder about the origin with its axis along z."""
    points = np.asarray(points)
    aside = np.hypot(points[..., 0], points[..., 1]) - radius
    above = np.abs(points[..., 2]) - length / 2
    return _from_excess(np.stack([aside, above], axis=-1))


def to_capsule(points, radius, length):
    """Returns the distance from a capsule about the origin with its axis along z; `length` is without the caps."""
    on_axis = np.zeros(np.shape(points))
    on_axis[..., 2] = np.clip(np.asarray(points)[..., 2], -length / 2, length / 2)
    return np.linalg.norm(points - on_axis, axis=-1) - radius


def to_obstacle(points, obstacle: Obstacle):
    """Returns the distance of points in the world from an obstacle of a cell."""
    # A row vector times R is the vector rotated by the inverse of R.
    local = (np.asarray(points) - obstacle.position) @ matrix_from_quaternion(obstacle.quaternion)
    if obstacle.shape == "box":
        return to_box(local, obstacle.size)
    if obstacle.shape == "sphere":
        return to_sphere(local, obstacle.radius)
    if obstacle.shape == "cylinder":
        return to_cylinder(local, obstacle.radius, obstacle.length)
    assert obstacle.shape == "capsule"
    return to_capsule(local, obstacle.radius, obstacle.length)
