"""Appearance of a cell: colours, floor, lights, and a camera that has the whole cell in the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Arm, Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.camera_view import CameraView

CAMERA = "overview"
TABLE_RGBA = (0.79, 0.79, 0.78, 1.0)
OBJECT_RGBA = (0.75, 0.06, 0.24, 1.0)
"""Colour of objects that an arm can hold, on the table and in the tool. No arm has it."""
OBSTACLE_RGBA = (0.38, 0.42, 0.50, 1.0)
_OBJECT_M = 0.1
"""Upper bound of the longest edge of an object that an arm can hold."""
SKY = {"rgb1": (0.93, 0.95, 0.97), "rgb2": (0.72, 0.77, 0.82), "width": 64, "height": 384}
"""Sky texture: a gradient from the first colour down to the second."""
_FLOOR_RGBA = (0.56, 0.59, 0.63, 1.0)
_FIELD_OF_VIEW = np.radians(28)
_ASPECT = 4 / 3
_FROM_DIRECTION = np.array([0.48, -1.57, 1.08])
"""Direction from the cell to the camera. It is not along an axis, so no arm of a ring hides the opposite one."""
_OUTWARD, _UPWARD = 0.7, 1.4
"""Radius and height of the dome over each base that the picture shows, relative to the reach."""
_BESIDE = 0.35
"""Distance beyond the domes up to which the picture shows obstacles, relative to the reach."""
_LEVEL_M = 0.01
_ROOM = 1.03
"""Factor of the camera distance, for a border around the cell."""
_CENTRING = 20
_RINGS = np.radians([0, 30, 60, 90])
_AROUND = np.linspace(0, 2 * np.pi, 16, endpoint=False)


def set_stage(spec: Any, cell: Cell) -> None:
    """Adds floor, sky, lights and the camera `overview` to a spec. They take no part in collisions."""
    points = outline(cell)
    low, high = points.min(axis=0), points.max(axis=0)
    center, extent = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    _add_surroundings(spec, center, extent, float(low[2]))
    eye, axes = camera_pose(points)
    spec.worldbody.add_camera(name=CAMERA, pos=eye, quat=_quaternion(axes), fovy=float(np.degrees(_FIELD_OF_VIEW)))
    spec.stat.center, spec.stat.extent = center, extent
    spec.visual.global_.fovy = float(np.degrees(_FIELD_OF_VIEW))  # field of view of the window
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.35] * 3, [0.25] * 3
    spec.visual.headlight.specular = [0.05] * 3
    spec.visual.quality.shadowsize = 2048
    spec.visual.quality.numslices, spec.visual.quality.numstacks = 16, 6
    spec.visual.map.shadowclip = 2.2  # with less, the floor has specks of shadow; with more, shadows have steps
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
        **SKY,
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


def obstacle_rgba(cell: Cell, obstacle: Obstacle) -> tuple[float, float, float, float]:
    """Returns a light colour for the ground of the arms, red for small objects, and a dark colour for others."""
    if is_ground(cell, obstacle):
        return TABLE_RGBA
    return OBJECT_RGBA if 2 * obstacle.half_extents.max() < _OBJECT_M else OBSTACLE_RGBA


def is_ground(cell: Cell, obstacle: Obstacle) -> bool:
    """Returns whether an obstacle is a table or floor: below the lowest base, and thicker than 1 mm."""
    lowest = min(arm.position[2] for arm in cell.arms)
    heights = corners(obstacle)[:, 2]
    return bool(heights.max() <= lowest + _LEVEL_M and heights.min() < lowest - _LEVEL_M / 10)


def outline(cell: Cell) -> Float[np.ndarray, "p 3"]:
    """Returns points that the picture must show [m]: a dome over each base, and the obstacles near the domes.

    Obstacles that extend far beyond the domes are cut off; floors are left out.
    """
    domes = np.concatenate([_dome(arm) for arm in cell.arms])
    low, high = domes.min(axis=0), domes.max(axis=0)
    over = _BESIDE * max(arm.robot.reach for arm in cell.arms)
    parts = [domes]
    for obstacle in cell.obstacles:
        box = corners(obstacle)
        first, last = box.min(axis=0), box.max(axis=0)
        beside = (last[:2] >= low[:2]).all() and (first[:2] <= high[:2]).all()
        below_all = (first[:2] <= low[:2]).all() and (last[:2] >= high[:2]).all()
        if beside and not below_all:
            parts.append(np.clip(box, low - over, high + over))
    return np.concatenate(parts)


def _dome(arm: Arm) -> Float[np.ndarray, "d 3"]:
    """Returns points [m] of half an ellipsoid over the base, which stands for the reach of the arm."""
    around, up = (part.ravel() for part in np.meshgrid(_AROUND, _RINGS))
    radius, height = _OUTWARD * arm.robot.reach, _UPWARD * arm.robot.reach
    points = np.column_stack(
        [radius * np.cos(up) * np.cos(around), radius * np.cos(up) * np.sin(around), height * np.sin(up)]
    )
    return points @ arm.T_world_base[:3, :3].T + arm.position


def corners(obstacle: Obstacle) -> Float[np.ndarray, "8 3"]:
    """Returns the corners [m] of the oriented bounding box of an obstacle."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    box = signs * obstacle.half_extents + obstacle.middle
    return box @ matrix_from_quaternion(obstacle.quaternion).T + obstacle.position


def _overview_axes() -> Float[np.ndarray, "3 3"]:
    backward = _FROM_DIRECTION / np.linalg.norm(_FROM_DIRECTION)
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(backward, right), backward])


def camera_pose(
    points: Float[np.ndarray, "p 3"], aspect: float = _ASPECT, axes: Float[np.ndarray, "3 3"] | None = None
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]:
    """Returns position [m] and rotation matrix of a camera whose picture the points fill.

    `axes` are the columns of the matrix (x right, y up, z back), by default those of the overview.
    """
    axes = _overview_axes() if axes is None else axes
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    seen = (points - center) @ axes
    tangents = np.tan(_FIELD_OF_VIEW / 2) * np.array([aspect, 1.0])
    # Two planes through the eye bound the picture on either side. They touch the outermost points if these fill it.
    high = (seen[:, :2] + tangents * seen[:, 2:]).max(axis=0)
    low = (seen[:, :2] - tangents * seen[:, 2:]).min(axis=0)
    distance = float(((high - low) / (2 * tangents)).max()) * _ROOM
    aside = (high + low) / 2
    for _ in range(_CENTRING):  # centres the direction that the points do not fill
        rays = (seen[:, :2] - aside) / (distance - seen[:, 2:])
        aside += distance * (rays.max(axis=0) + rays.min(axis=0)) / 2
    return center + axes @ [*aside, distance], axes


def view_frame(
    points: Float[np.ndarray, "p 3"], view: CameraView, aspect: float
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4"]]:
    """Returns position [m] of the camera of a view of the points, and left, right, bottom and top as of `frame`."""
    if view.distance is None:
        eye, axes = camera_pose(points, aspect, view.axes)
        return eye, frame(points, eye, axes, aspect)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2 if view.lookat is None else np.asarray(view.lookat)
    half = float(np.tan(_FIELD_OF_VIEW / 2))
    return middle + view.distance * view.axes[:, 2], half * np.array([-aspect, aspect, -1.0, 1.0])


def frame(
    points: Float[np.ndarray, "p 3"], eye: Float[np.ndarray, "3"], axes: Float[np.ndarray, "3 3"], aspect: float
) -> Float[np.ndarray, "4"]:
    """Returns left, right, bottom and top of a picture of that `aspect` around the points, as lengths at distance 1."""
    right, up, back = ((points - eye) @ axes).T
    across, upward = right / -back, up / -back
    middle = np.array([across.min() + across.max(), upward.min() + upward.max()]) / 2
    half = _ROOM * max(np.ptp(across) / aspect, np.ptp(upward)) / 2
    return np.array([middle[0] - half * aspect, middle[0] + half * aspect, middle[1] - half, middle[1] + half])


def _quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    out = np.empty(4)
    mujoco.mju_mat2Quat(out, rotation.ravel())
    return out
