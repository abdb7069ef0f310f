"""Pictures of a simulated cell, as an array or in a window, with transparent arms at the goals."""

from __future__ import annotations

import atexit
import contextlib
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from mmp_env.argument_checks import whole
from mmp_env.errors import MmpError
from mmp_env.mujoco_import import mujoco
from mmp_env.opengl import MAX_PIXELS, check_render_mode, display_answers, open_context
from mmp_env.sim.camera_view import CameraView
from mmp_env.sim.scene_appearance import CAMERA, camera_pose, frame, outline, view_frame
from mmp_env.sim.simulation import Simulation

GHOST_ALPHA = 0.22
_MAX_GEOMS = 5000
_GLOW = 0.15
"""Share of a line's colour that does not depend on light."""
_FINER, _MOST_FINE_PIXELS = 2, 2048
"""Factor of supersampling of fine pictures, and the largest side [px] of a picture for it."""
_CLOSING_S = 5.0
"""Longest wait [s] for a window to close."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """A line through `points` [k, 3] [m] of a `thickness` [m]; `rgba` is red, green, blue, opacity, each 0..1."""

    points: Float[np.ndarray, "k 3"]
    rgba: tuple[float, float, float, float]
    thickness: float


class Camera:
    """Takes pictures from the cell's camera, without a display. The first picture opens the OpenGL context.

    Args:
        simulation: the simulated cell.
        width: width [px].
        height: height [px].
        fine: whether pictures have shadows and smooth edges. Without a graphics card they take several times as long.
        shown: points [p, 3] that the picture must contain [m]; by default the whole cell.
        view: the side from which the camera looks; by default obliquely from above.

    Raises:
        MmpError: for a size that is not allowed.
    """

    def __init__(
        self,
        simulation: Simulation,
        width: int,
        height: int,
        *,
        fine: bool = False,
        shown: Float[np.ndarray, "p 3"] | None = None,
        view: CameraView | None = None,
    ) -> None:
        for name, value in (("width", width), ("height", height)):
            whole(name, value, 1, MAX_PIXELS)
        self._simulation = simulation
        self._finer = _FINER if fine and max(width, height) <= _MOST_FINE_PIXELS else 1
        self._rectangle = mujoco.MjrRect(0, 0, self._finer * width, self._finer * height)
        self._scene = mujoco.MjvScene(simulation.model, maxgeom=_MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = fine
        self._ghosts = _Ghosts(simulation)
        self._option, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        points = outline(simulation.cell) if shown is None else shown
        self._frame = self._placed(points, width / height, view).tolist()
        self._context: Any = None
        self._buffer: Any = None

    def show(
        self, target: Float[np.ndarray, "n"] | None = None, lines: Sequence[Line] = ()
    ) -> UInt8[np.ndarray, "h w 3"]:
        """Returns a picture [height, width, 3] of the cell, with transparent arms at `target` [n] [rad] and `lines`.

        Raises `MmpError` that names the package to install if no OpenGL library is found.
        """
        model, rectangle = self._simulation.model, self._rectangle
        context = self._context or self._open()
        context.make_current()
        mujoco.mjv_updateScene(
            model, self._simulation.data, self._option, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        if target is not None:
            self._ghosts.add_to(self._scene, target)
        for line in lines:
            _add_line(self._scene, line)
        self._aim()
        out = np.empty((rectangle.height, rectangle.width, 3), np.uint8)
        mujoco.mjr_render(rectangle, self._scene, self._buffer)
        mujoco.mjr_readPixels(out, None, rectangle, self._buffer)
        return _shrunk(out[::-1], self._finer)

    def _placed(
        self, points: Float[np.ndarray, "p 3"], aspect: float, view: CameraView | None
    ) -> Float[np.ndarray, "4"]:
        """Places MuJoCo's camera. Returns left, right, bottom and top of the picture at distance 1."""
        if view is None:
            self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
            self._camera.fixedcamid = self._simulation.model.camera(CAMERA).id
            fixed = self._simulation.data.camera(CAMERA)
            return frame(points, fixed.xpos, fixed.xmat.reshape(3, 3), aspect)
        eye, sides = view_frame(points, view, aspect)
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._camera.azimuth, self._camera.elevation, self._camera.distance = view.azimuth, view.elevation, 1.0
        self._camera.lookat = eye - view.axes[:, 2]
        return sides

    def _aim(self) -> None:
        """Sets the frustum of both eyes of MuJoCo's camera, which are the same here."""
        for eye in self._scene.camera:
            left, right, bottom, top = (eye.frustum_near * side for side in self._frame)
            eye.frustum_center, eye.frustum_width = (left + right) / 2, (right - left) / 2
            eye.frustum_bottom, eye.frustum_top = bottom, top

    def close(self) -> None:
        """Frees the OpenGL context; a later picture opens a new one."""
        if self._context is not None:
            self._context.make_current()
            self._buffer.free()
            self._context.free()
            self._context = None

    def _open(self) -> Any:
        model, rectangle = self._simulation.model, self._rectangle
        context = open_context(rectangle.width, rectangle.height)
        context.make_current()
        model.vis.quality.offsamples = 0
        model.vis.global_.offwidth, model.vis.global_.offheight = rectangle.width, rectangle.height
        self._buffer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._buffer)
        self._context = context
        return context


class Window:
    """MuJoCo's viewer, synchronised with simulated time. A program can have one at a time.

    Raises `MmpError` if no display answers.
    """

    def __init__(self, simulation: Simulation, *_: int) -> None:
        check_render_mode("human")
        if not display_answers():
            raise MmpError("no window can be opened: the display does not answer")
        from mujoco import viewer

        self._simulation, self._ghosts = simulation, _Ghosts(simulation)
        others = set(threading.enumerate())
        try:
            self._viewer = viewer.launch_passive(
                simulation.model, simulation.data, show_left_ui=False, show_right_ui=False
            )
        except RuntimeError as error:  # for example a Python on macOS that is not mjpython
            raise MmpError(f"MuJoCo opens no window ({error})") from error
        self._threads = [thread for thread in threading.enumerate() if thread not in others]
        # Runs before MuJoCo's own exit handler, which closes the display while its threads still use it.
        atexit.register(self.close)
        _frame_cell(self._viewer, simulation)
        self._begin_s, self._before_s = time.monotonic(), 0.0

    @property
    def is_open(self) -> bool:
        """Whether the window is still open."""
        return self._viewer.is_running()

    def show(self, target: Float[np.ndarray, "n"] | None = None) -> None:
        """Updates the window at the simulated time; does nothing once it is closed."""
        if not self.is_open:
            return
        with self._viewer.lock():
            self._viewer.user_scn.ngeom = 0
            if target is not None:
                self._ghosts.add_to(self._viewer.user_scn, target)
        now_s = float(self._simulation.data.time)
        ahead_s = now_s - (time.monotonic() - self._begin_s)
        if now_s < self._before_s or ahead_s < 0:  # restarted, or slower than real time
            self._begin_s = time.monotonic() - now_s
        else:
            time.sleep(ahead_s)
        self._before_s = now_s
        self._viewer.sync()

    def close(self) -> None:
        """Closes the window and waits until it is gone."""
        atexit.unregister(self.close)
        with contextlib.suppress(RuntimeError):
            self._viewer.close()
        for thread in self._threads:
            thread.join(_CLOSING_S)


def _frame_cell(viewer: Any, simulation: Simulation) -> None:
    """Sets the viewer's camera, which the mouse can move, so that the cell fills the window."""
    window = viewer.viewport
    shape = (window.width / window.height,) if window is not None and window.height > 0 else ()
    eye, axes = camera_pose(outline(simulation.cell), *shape)
    forward, camera = -axes[:, 2], viewer.cam
    camera.distance = float(forward @ (simulation.model.stat.center - eye))
    camera.lookat = eye + camera.distance * forward
    camera.azimuth, camera.elevation = np.degrees([np.arctan2(forward[1], forward[0]), np.arcsin(forward[2])])


class _Ghosts:
    """The moving links at another configuration, transparent."""

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
            _cast_no_shadow(geom)


def _add_line(scene: Any, line: Line) -> None:
    """Adds a line as capsules, which are shaded and hidden like other geoms, as far as the scene has room."""
    nothing, turned, rgba = np.zeros(3), np.eye(3).ravel(), np.array(line.rgba, np.float32)
    for begin, end in pairwise(line.points):
        if (begin == end).all():
            continue
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, nothing, nothing, turned, rgba)
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, line.thickness / 2, begin, end)
        geom.category, geom.emission = mujoco.mjtCatBit.mjCAT_DECOR, _GLOW
        _cast_no_shadow(geom)
        scene.ngeom += 1


def _cast_no_shadow(geom: Any) -> None:
    """Switches off the shadow of a geom, which MuJoCo leaves undefined; older versions have no such field."""
    if hasattr(geom, "castshadow"):
        geom.castshadow = False


def _shrunk(picture: UInt8[np.ndarray, "H W 3"], factor: int) -> UInt8[np.ndarray, "h w 3"]:
    """Returns a copy in which each pixel is the mean of `factor` x `factor` pixels."""
    if factor == 1:
        return np.ascontiguousarray(picture)
    sums = np.zeros((picture.shape[0] // factor, picture.shape[1] // factor, 3), np.uint16)
    for i, j in np.ndindex(factor, factor):
        sums += picture[i::factor, j::factor]
    return ((sums + factor**2 // 2) // factor**2).astype(np.uint8)
