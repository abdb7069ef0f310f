"""Held objects, which move with the tool of their arm. Spheres cover them in every query.

docs/reference/files.md states the rule of the cover; the checker follows it with its own code.
"""

from __future__ import annotations

import itertools

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Obstacle
from mmp_env.model.transforms import matrix_from_quaternion

HELD = "held"
"""Name of a held object beside the links of its arm: `arm0/held`."""
MOST_SPHERES = 64
"""Largest number of spheres that cover an object."""
PITCH_M = 0.02
"""Largest edge [m] of the cells of a box, unless there are more than `MOST_SPHERES` cells."""
_PRISM_SIDES = 32
_COARSER = 1.25
"""Factor of the edge for fewer cells."""


def covering_spheres(solid: Obstacle) -> tuple[Float[np.ndarray, "s 3"], Float[np.ndarray, "s"]]:
    """Returns centres [s, 3] [m], in the frame of the solid's pose, and radii [s] [m] of spheres that cover a solid.

    The spheres of a box of 4 x 4 x 8 cm protrude by 7 mm.
    """
    centers, radius = _box(solid.size) if solid.size is not None else _round(solid)
    placed = centers @ matrix_from_quaternion(solid.quaternion).T + solid.position
    return placed, np.full(len(placed), radius)


def solid_hull(solid: Obstacle) -> tuple[Float[np.ndarray, "v 3"], float]:
    """Returns vertices [v, 3] [m], in the frame of the solid's pose, and a radius [m] by which their hull grows.

    The result is the solid itself; a cylinder lies in a prism that protrudes by 0.5 % of its radius.
    """
    radius, length = solid.radius or 0.0, solid.length or 0.0
    axis = np.array([[0.0, 0.0, -length / 2], [0.0, 0.0, length / 2]])
    if solid.size is not None:
        points, radius = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * solid.size, 0.0
    elif solid.shape == "sphere":
        points = np.zeros((1, 3))
    elif solid.shape == "capsule":
        points = axis
    else:
        angle = 2 * np.pi * np.arange(_PRISM_SIDES) / _PRISM_SIDES
        ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * radius / np.cos(np.pi / _PRISM_SIDES)
        points, radius = (ring[:, None] + axis).reshape(-1, 3), 0.0
    return points @ matrix_from_quaternion(solid.quaternion).T + solid.position, radius


def _box(size: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "s 3"], float]:
    """Returns spheres around equal cells of a box."""
    pitch = PITCH_M
    while np.prod(np.ceil(size / pitch)) > MOST_SPHERES:
        pitch *= _COARSER
    counts = np.ceil(size / pitch).astype(int)
    steps = size / counts
    rows = [(np.arange(n) + 0.5) * step - n * step / 2 for n, step in zip(counts, steps, strict=True)]
    return np.array(list(itertools.product(*rows))), float(np.linalg.norm(steps / 2))


def _round(solid: Obstacle) -> tuple[Float[np.ndarray, "s 3"], float]:
    """Returns spheres along the z axis."""
    radius, length = solid.radius or 0.0, solid.length or 0.0
    if length == 0.0:
        return np.zeros((1, 3)), radius
    if solid.shape == "capsule":  # from one centre of a cap to the other; the spheres at the ends cover the caps
        count = min(int(np.ceil(length / radius)), MOST_SPHERES - 1)
        heights = np.linspace(-length / 2, length / 2, count + 1)
    else:
        count = min(int(np.ceil(length / (2 * radius))), MOST_SPHERES)
        heights = ((np.arange(count) + 0.5) / count - 0.5) * length
    return np.outer(heights, [0.0, 0.0, 1.0]), float(np.hypot(radius, length / (2 * count)))
