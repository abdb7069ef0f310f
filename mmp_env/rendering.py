"""Pictures of a simulated cell, into an array or a window, with the goals as ghosts."""

from __future__ import annotations

import contextlib
import time
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.errors import MmpError
from mmp_env.mujoco_import import mujoco
from mmp_env.opengl import check_render_mode, open_context
from mmp_env.simulation import Simulation
from mmp_env.staging import CAMERA

GHOST_ALPHA = 0.22
_MOST_PIXELS = 4096
_MAX_GEOMS = 5000
_FINE_SAMPLES = 4


class Camera:
    """Takes pictures of `width` x `height` pixels through the cell's camera, without a display.

    `fine` pictures have shadows and smooth edges; without a graphics card they take ten times as long. The OpenGL
    context is opened with the first picture. Raises `MmpError` for a size that is not sensible.
    """

    def __init__(self, simulation: Simulation, width: int, height: int, *, fine: bool = False) -> None:
        for name, value in (("width", width), ("height", height)):
            if not 0 < value <= _MOST_PIXELS:
                raise MmpError(f"{name} is {value}; a picture has 1 to {_MOST_PIXELS} pixels each way")
        self._simulation = simulation
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._scene = mujoco.MjvScene(simulation.model, maxgeom=_MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = fine
        self._samples = _FINE_SAMPLES if fine else 0
        self._ghosts = _Ghosts(simulation)
        self._option, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = simulation.model.camera(CAMERA).id
        self._context: Any = None
        self._buffer: Any = None

    def show(self, target: Float[np.ndarray, "n"] | None = None) -> UInt8[np.ndarray, "h w 3"]:
        """A picture of the cell as it stands, with the arms at `target` [n] [rad] as ghosts; a fresh array.

        Raises `MmpError` that names the package to install where no OpenGL library is found.
        """
        model, rectangle = self._simulation.model, self._rectangle
        context = self._context or self._open()
        context.make_current()
        mujoco.mjv_updateScene(
            model, self._simulation.data, self._option, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        if target is not None:
            self._ghosts.add_to(self._scene, target)
        out = np.empty((rectangle.height, rectangle.width, 3), np.uint8)
        mujoco.mjr_render(rectangle, self._scene, self._buffer)
        mujoco.mjr_readPixels(out, None, rectangle, self._buffer)
        return np.ascontiguousarray(out[::-1])

    def close(self) -> None:
        """Frees the OpenGL context; a later picture opens another."""
        if self._context is not None:
            self._context.make_current()
            self._buffer.free()
            self._context.free()
            self._context = None

    def _open(self) -> Any:
        model, rectangle = self._simulation.model, self._rectangle
        context = open_context(rectangle.width, rectangle.height)
        context.make_current()
        model.vis.quality.offsamples = self._samples
        model.vis.global_.offwidth, model.vis.global_.offheight = rectangle.width, rectangle.height
        self._buffer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._buffer)
        self._context = context
        return context


class Window:
    """MuJoCo's viewer, kept in step with simulated time. Raises `MmpError` where there is no display."""

    def __init__(self, simulation: Simulation, *_: int) -> None:
        check_render_mode("human")
        from mujoco import viewer

        self._simulation, self._ghosts = simulation, _Ghosts(simulation)
        self._viewer = viewer.launch_passive(simulation.model, simulation.data, show_left_ui=False, show_right_ui=False)
        _look_like_fixed_camera(self._viewer.cam, simulation)
        self._begin_s, self._before_s = time.monotonic(), 0.0

    def show(self, target: Float[np.ndarray, "n"] | None = None) -> None:
        """Brings the window up to date, not before its time has come; does nothing once it is closed."""
        if not self._viewer.is_running():
            return
        with self._viewer.lock():
            self._viewer.user_scn.ngeom = 0
            if target is not None:
                self._ghosts.add_to(self._viewer.user_scn, target)
        now_s = float(self._simulation.data.time)
        ahead_s = now_s - (time.monotonic() - self._begin_s)
        if now_s < self._before_s or ahead_s < 0:  # started anew, or slower than real time
            self._begin_s = time.monotonic() - now_s
        else:
            time.sleep(ahead_s)
        self._before_s = now_s
        self._viewer.sync()

    def close(self) -> None:
        """Closes the window."""
        with contextlib.suppress(RuntimeError):
            self._viewer.close()


def _look_like_fixed_camera(camera: Any, simulation: Simulation) -> None:
    """Sets a camera that the mouse can move to where the cell's own one stands."""
    fixed = simulation.data.camera(CAMERA)
    forward = -fixed.xmat.reshape(3, 3)[:, 2]
    distance = float(forward @ (simulation.model.stat.center - fixed.xpos))
    camera.distance, camera.lookat = distance, fixed.xpos + distance * forward
    camera.azimuth, camera.elevation = np.degrees([np.arctan2(forward[1], forward[0]), np.arcsin(forward[2])])


class _Ghosts:
    """The moving links at another configuration, see-through."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._data = mujoco.MjData(simulation.model)
        self._option, self._nothing = mujoco.MjvOption(), mujoco.MjvPerturb()

    def add_to(self, scene: Any, target: Float[np.ndarray, "n"]) -> None:
        model = self._simulation.model
        self._data.qpos[:] = target
        mujoco.mj_kinematics(model, self._data)
        first = scene.ngeom
        mujoco.mjv_addGeoms(model, self._data, self._option, self._nothing, mujoco.mjtCatBit.mjCAT_DYNAMIC, scene)
        for geom in scene.geoms[first : scene.ngeom]:
            geom.rgba[3] = GHOST_ALPHA
