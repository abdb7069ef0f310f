"""Pictures of a cell, and the errors where none can be made."""

import os
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from support.picture_or_sentence import without_libraries

from mmp_env import opengl, ring_cell
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.mujoco_import import mujoco
from mmp_env.sim import rendering
from mmp_env.sim.arm_colors import PALETTE
from mmp_env.sim.rendering import Window, _frame_cell
from mmp_env.sim.scene_appearance import outline
from mmp_env.sim.simulation import Simulation


def make(name="MultiArmCell-2", **options):
    return gymnasium.make(name, **options)


def tucked(cell):
    return {arm.name: np.array(arm.robot.tucked) for arm in cell.arms}


def test_a_picture_shows_every_arm_or_else_the_error_names_the_package():
    if "rgb_array" not in make().metadata["render_modes"]:
        with pytest.raises(MmpError, match=r"apt install|MUJOCO_GL"):
            make(render_mode="rgb_array")
        return
    env = make("MultiArmCell-4", render_mode="rgb_array", width=320, height=240)
    env.reset(options={"start": tucked(env.unwrapped.cell), "goal": tucked(env.unwrapped.cell)})
    picture = env.render()
    assert picture.shape == (240, 320, 3)
    assert picture.dtype == np.uint8
    shades = picture.reshape(-1, 3) / np.maximum(np.linalg.norm(picture.reshape(-1, 3), axis=1), 1)[:, None]
    for colour in PALETTE[:4]:
        likeness = shades @ (np.array(colour) / np.linalg.norm(colour))
        assert (likeness > 0.995).sum() > 50
    env.close()
    assert (env.render() == picture).all()
    env.close()


@pytest.mark.parametrize("count", [2, 8])
@pytest.mark.parametrize(("width", "height"), [(1600, 900), (600, 900)])
def test_a_window_of_any_shape_has_the_whole_cell_in_its_middle(count, width, height):
    simulation = Simulation(ring_cell(count))
    viewer = SimpleNamespace(viewport=SimpleNamespace(width=width, height=height), cam=mujoco.MjvCamera())
    _frame_cell(viewer, simulation)
    eye, forward, upward = camera_axes(viewer.cam)
    points = outline(simulation.cell) - eye
    tangent = np.tan(np.radians(simulation.model.vis.global_.fovy) / 2)
    high = points @ upward / (points @ forward) / tangent
    across = points @ np.cross(forward, upward) / (points @ forward) / (tangent * width / height)
    for side in (high, across):
        assert abs(side).max() < 1
        assert abs(side.max() + side.min()) < 1e-3
    assert max(abs(high).max(), abs(across).max()) > 0.93


def camera_axes(camera):
    """Returns eye, direction and upward direction of MuJoCo's free camera, from its angles."""
    azimuth, elevation = np.radians([camera.azimuth, camera.elevation])
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    forward = np.cos(elevation) * level + [0, 0, np.sin(elevation)]
    upward = -np.sin(elevation) * level + [0, 0, np.cos(elevation)]
    return camera.lookat - camera.distance * forward, forward, upward


def test_a_missing_library_is_named_with_the_package_that_has_it(monkeypatch):
    with without_libraries(monkeypatch):
        with pytest.raises(MmpError, match=r"neither EGL nor OSMesa .*libegl1 libgl1"):
            opengl.offscreen_backend()
        monkeypatch.setenv("MUJOCO_GL", "osmesa")
        with pytest.raises(MmpError, match="apt install libosmesa6"):
            opengl.offscreen_backend()
        assert opengl.possible_render_modes(["human", "rgb_array"]) == []
        monkeypatch.setenv("MUJOCO_GL", "elg")
        with pytest.raises(UnknownNameError, match="Did you mean 'egl'"):
            opengl.offscreen_backend()


def test_a_mistyped_backend_is_named_when_mujoco_is_imported():
    run = subprocess.run(
        [sys.executable, "-c", "import mmp_env.gym.env"],
        capture_output=True,
        text=True,
        env=os.environ | {"MUJOCO_GL": "elg"},
    )
    assert run.stderr.splitlines()[-1].endswith(
        "unknown value of MUJOCO_GL 'elg'. Did you mean 'egl'? Known: disable, egl, glfw, osmesa"
    )


def test_a_window_without_a_display_is_refused_at_once(monkeypatch):
    monkeypatch.setattr(opengl.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(MmpError, match="needs a display"):
        make(render_mode="human")


def test_a_display_that_does_not_answer_is_refused_before_the_viewer_would_end_the_program(monkeypatch):
    monkeypatch.setattr(rendering, "check_render_mode", lambda mode: None)
    monkeypatch.setattr(rendering, "display_answers", lambda: False)
    with pytest.raises(MmpError, match="does not answer"):
        Window(Simulation(ring_cell(2)))


def test_a_window_is_gone_when_closing_returns(monkeypatch):
    # A window that still draws when the program ends causes a segmentation fault.
    monkeypatch.setattr(rendering, "check_render_mode", lambda mode: None)
    monkeypatch.setattr(rendering, "display_answers", lambda: True)
    closing, gone = threading.Event(), threading.Event()

    def draw():
        closing.wait()
        time.sleep(0.05)
        gone.set()

    def launch_passive(model, data, **_):
        threading.Thread(target=draw, daemon=True).start()
        return SimpleNamespace(viewport=None, cam=mujoco.MjvCamera(), close=closing.set)

    monkeypatch.setattr("mujoco.viewer.launch_passive", launch_passive)
    Window(Simulation(ring_cell(2))).close()
    assert gone.is_set()
