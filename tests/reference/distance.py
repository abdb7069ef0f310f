"""Signed distance of points from a solid [m]: negative inside. `points` are [..., 3]."""

import numpy as np

from mmp_env.model.arm import Obstacle
from mmp_env.model.transforms import matrix_from_quaternion


def _from_excess(excess):
    """From how far a point is beyond each of several perpendicular walls: [..., walls], negative on the inner side."""
    outside = np.linalg.norm(np.maximum(excess, 0), axis=-1)
    inside = np.minimum(excess.max(axis=-1), 0)
    return outside + inside


def to_box(points, size):
    """From a box about the origin with full edge lengths `size`."""
    return _from_excess(np.abs(points) - np.asarray(size) / 2)


def to_sphere(points, radius):
    """From a sphere about the origin."""
    return np.linalg.norm(points, axis=-1) - radius


def to_cylinder(points, radius, length):
    """From a cylinder about the origin, its axis along z."""
    points = np.asarray(points)
    aside = np.hypot(points[..., 0], points[..., 1]) - radius
    above = np.abs(points[..., 2]) - length / 2
    return _from_excess(np.stack([aside, above], axis=-1))


def to_capsule(points, radius, length):
    """From a capsule about the origin, its axis along z; `length` is without the caps."""
    on_axis = np.zeros(np.shape(points))
    on_axis[..., 2] = np.clip(np.asarray(points)[..., 2], -length / 2, length / 2)
    return np.linalg.norm(points - on_axis, axis=-1) - radius


def to_obstacle(points, obstacle: Obstacle):
    """From an obstacle of a cell, for points of the world."""
    # A row vector times R is the inverse rotation of it.
    local = (np.asarray(points) - obstacle.position) @ matrix_from_quaternion(obstacle.quaternion)
    if obstacle.shape == "box":
        return to_box(local, obstacle.size)
    if obstacle.shape == "sphere":
        return to_sphere(local, obstacle.radius)
    if obstacle.shape == "cylinder":
        return to_cylinder(local, obstacle.radius, obstacle.length)
    assert obstacle.shape == "capsule"
    return to_capsule(local, obstacle.radius, obstacle.length)
