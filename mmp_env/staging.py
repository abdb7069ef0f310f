"""How a cell looks: the arms' colours, floor, light, and a camera from which all of it is in the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.cell import Cell
from mmp_env.mujoco_import import mujoco
from mmp_env.transforms import matrix_from_quaternion

CAMERA = "overview"
PALETTE = (
    (0.00, 0.45, 0.70),
    (0.90, 0.62, 0.00),
    (0.00, 0.62, 0.45),
    (0.80, 0.47, 0.65),
    (0.34, 0.71, 0.91),
    (0.84, 0.37, 0.00),
    (0.94, 0.89, 0.26),
    (0.38, 0.38, 0.38),
)
"""Colours that colour-blind people can tell apart, in an order that keeps neighbours far from each other.

After M. Okabe and K. Ito, "Color Universal Design", with dark grey for their black.
"""
TABLE_RGBA = (0.80, 0.79, 0.76, 1.0)
_FLOOR_RGBA = (0.58, 0.60, 0.63, 1.0)
_FIELD_OF_VIEW = np.radians(40)
_ASPECT = 4 / 3
_FROM_DIRECTION = np.array([0.82, -1.42, 1.30])
"""Where the camera stands, seen from the cell; not along an axis, so that no arm of a ring hides the one opposite."""
_STRETCHED, _BESIDE = 1.15, 0.3
"""In the picture are this many reaches of height above a base, and of obstacles beside it."""
_ROOM = 1.04
"""The camera stands back by this factor, for a border around the cell."""


def arm_color(number: int) -> tuple[float, float, float]:
    """Red, green, blue in 0..1 of the arm of that number; after eight arms they come again."""
    return PALETTE[number % len(PALETTE)]


def set_stage(spec: Any, cell: Cell) -> None:
    """Adds floor, sky, lights and the camera `overview` to a spec. None of it takes part in a collision."""
    points = _outline(cell)
    low, high = points.min(axis=0), points.max(axis=0)
    center, extent = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    _add_surroundings(spec, center, extent, float(low[2]))
    eye, axes = _camera_pose(points, center)
    spec.worldbody.add_camera(name=CAMERA, pos=eye, quat=_quaternion(axes), fovy=float(np.degrees(_FIELD_OF_VIEW)))
    spec.stat.center, spec.stat.extent = center, extent
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.35] * 3, [0.25] * 3
    spec.visual.headlight.specular = [0.05] * 3
    spec.visual.quality.shadowsize = 4096
    spec.visual.quality.numslices, spec.visual.quality.numstacks = 20, 10
    spec.visual.map.shadowclip = 3.0  # with less, the floor has specks of shadow
    spec.visual.map.znear, spec.visual.map.zfar = 0.02, 50.0


def _add_surroundings(spec: Any, center: Float[np.ndarray, "3"], extent: float, floor_height: float) -> None:
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 1],
        pos=[center[0], center[1], floor_height - 1e-3],
        rgba=_FLOOR_RGBA,
        contype=0,
        conaffinity=0,
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.95, 0.97],
        rgb2=[0.72, 0.77, 0.82],
        width=64,
        height=384,
    )
    height = center[2] + 3 * extent
    for side, brightness in (((1.0, -1.6), 0.55), ((-1.4, 0.6), 0.2)):
        position = [center[0] + side[0] * extent, center[1] + side[1] * extent, height]
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=position,
            dir=center - position,
            diffuse=[brightness] * 3,
            specular=[0.1] * 3,
            castshadow=bool(brightness > 0.5),
        )


def _outline(cell: Cell) -> Float[np.ndarray, "p 3"]:
    """Points that the picture must hold: bases, the arms' height above them, and what obstacles are near them."""
    bases = np.array([arm.position for arm in cell.arms])
    upward = np.array([arm.T_world_base[:3, 2] * arm.robot.reach for arm in cell.arms])
    points = [*bases, *(bases + _STRETCHED * upward)]
    center = bases.mean(axis=0)
    limit = np.linalg.norm(bases - center, axis=1).max() + _BESIDE * max(arm.robot.reach for arm in cell.arms)
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    for obstacle in cell.obstacles:
        if obstacle.size is not None:
            half = obstacle.size / 2
        else:
            radius = obstacle.radius or 0.0
            half = np.array([radius, radius, max(radius, (obstacle.length or 0.0) / 2)])
        turned = (corners * half) @ matrix_from_quaternion(obstacle.quaternion).T + obstacle.position
        points += list(center + np.clip(turned - center, -limit, limit))
    return np.array(points)


def _camera_pose(
    points: Float[np.ndarray, "p 3"], center: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Position, and rotation matrix (x right, y up, z towards the viewer), from which all points fill the picture."""
    backward = _FROM_DIRECTION / np.linalg.norm(_FROM_DIRECTION)
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    axes = np.column_stack([right, np.cross(backward, right), backward])
    seen = (points - center) @ axes
    tangents = np.tan(_FIELD_OF_VIEW / 2) * np.array([_ASPECT, 1.0])
    # The lines of sight through a point leave the eye between two planes; the outermost of these on either side meet
    # where the points fill the picture exactly.
    high = (seen[:, :2] + tangents * seen[:, 2:]).max(axis=0)
    low = (seen[:, :2] - tangents * seen[:, 2:]).min(axis=0)
    distance = ((high - low) / (2 * tangents)).max()
    return center + axes @ [*(high + low) / 2, distance * _ROOM], axes


def _quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    out = np.empty(4)
    mujoco.mju_mat2Quat(out, rotation.ravel())
    return out
