"""A picture of one robot at home: its geometry, and the spheres of each set that cover it, side by side."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
from jaxtyping import UInt8

from mmp_env.files.writing import check_writable, whole_file
from mmp_env.model.robot import SPHERE_SETS, Robot
from mmp_env.mujoco_import import mujoco, without_log
from mmp_env.opengl import offscreen_backend, open_context
from mmp_env.view.pictures import encoded, labelled, picture_format

_WIDTH, _HEIGHT = 480, 640
_GAP = 4
_SPHERE_RGBA = (0.27, 0.53, 0.80, 1.0)
_BACKGROUND = (0.96, 0.97, 0.98)


def save_robot_picture(robot: Robot, path: str | PathLike[str]) -> None:
    """Writes a PNG, JPEG or WebP file, by its suffix. Raises `MmpError`, and then has written nothing."""
    suffix = picture_format(path)
    check_writable(path)
    offscreen_backend()
    content = encoded(robot_picture(robot), suffix)
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def robot_picture(robot: Robot) -> UInt8[np.ndarray, "h w 3"]:
    """Returns the geometry and the sphere sets side by side. Raises `MmpError` where no OpenGL library is found."""
    parts = [labelled(_shot(robot, None), "geometry")]
    parts += [
        labelled(_shot(robot, key), f"spheres {key}: {len(robot.spheres[key].radii)}")
        for key in SPHERE_SETS
        if key in robot.spheres
    ]
    gap = np.full((_HEIGHT, _GAP, 3), 255, np.uint8)
    return np.concatenate([part for shot in parts for part in (gap, shot)][1:], axis=1)


def _shot(robot: Robot, sphere_set: str | None) -> UInt8[np.ndarray, "h w 3"]:
    with without_log():
        spec = mujoco.MjSpec.from_string(robot.mjcf)
    if sphere_set is not None:
        for geom in list(spec.geoms):
            spec.delete(geom)
        spheres = robot.spheres[sphere_set]
        for link, center, radius in zip(spheres.links, spheres.centers, spheres.radii, strict=True):
            spec.body(robot.link_names[link]).add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], pos=center, rgba=_SPHERE_RGBA
            )
    spec.worldbody.add_light(pos=[2, -2, 4], dir=[-0.4, 0.4, -0.8], diffuse=[0.5, 0.5, 0.5])
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.map.znear = 0.01
    spec.visual.global_.offwidth, spec.visual.global_.offheight = _WIDTH, _HEIGHT
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = robot.home
    mujoco.mj_forward(model, data)
    return _rendered(model, data)


def _rendered(model: Any, data: Any) -> UInt8[np.ndarray, "h w 3"]:
    points = data.geom_xpos
    low, high = points.min(axis=0), points.max(axis=0)
    camera = mujoco.MjvCamera()
    camera.lookat = (low + high) / 2
    camera.distance = 1.5 * float(np.linalg.norm(high - low)) + 0.5
    camera.azimuth, camera.elevation = 140, -15
    context = open_context(_WIDTH, _HEIGHT)
    try:
        context.make_current()
        rectangle = mujoco.MjrRect(0, 0, _WIDTH, _HEIGHT)
        buffer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, buffer)
        scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 100)
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
        scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = False
        out = np.empty((_HEIGHT, _WIDTH, 3), np.uint8)
        depth = np.empty((_HEIGHT, _WIDTH), np.float32)
        mujoco.mjr_render(rectangle, scene, buffer)
        mujoco.mjr_readPixels(out, depth, rectangle, buffer)
        buffer.free()
    finally:
        context.free()
    out[depth >= 1.0] = np.round(255 * np.array(_BACKGROUND)).astype(np.uint8)
    return out[::-1].copy()
