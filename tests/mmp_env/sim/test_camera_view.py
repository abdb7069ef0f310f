"""Views of the camera: their forms, their faults, and what the picture shows."""

import numpy as np
import pytest
from support.picture_or_sentence import made

from mmp_env import CameraView, MmpError, ring_cell
from mmp_env.sim.camera_view import SIDES, as_camera_view
from mmp_env.sim.rendering import Camera
from mmp_env.sim.scene_appearance import outline, view_frame
from mmp_env.sim.simulation import Simulation
from mmp_env.view.offscreen_renderer import OffscreenRenderer


@pytest.mark.parametrize("name", SIDES)
@pytest.mark.parametrize("distance", [None, 3.0])
def test_axes_are_those_of_the_free_camera_of_mujoco(name, distance):
    simulation = Simulation(ring_cell(2))
    azimuth, elevation = SIDES[name]
    view = CameraView(azimuth=azimuth, elevation=elevation, distance=distance)
    camera = Camera(simulation, 64, 48, view=view)
    made_pictures = made(camera.show)
    if made_pictures is None:
        return
    eye, _ = view_frame(outline(simulation.cell), view, 64 / 48)
    seen = camera._scene.camera[0]
    np.testing.assert_allclose(seen.pos, eye, atol=0.05)  # MuJoCo's two eyes are beside the middle
    np.testing.assert_allclose(seen.forward, -view.axes[:, 2], atol=1e-6)
    np.testing.assert_allclose(seen.up, view.axes[:, 1], atol=1e-6)
    camera.close()


@pytest.mark.parametrize("view", [*SIDES, "azimuth=30,elevation=-20"])
def test_a_view_without_a_distance_is_filled_by_what_it_shows(view):
    points = outline(ring_cell(4))
    eye, sides = view_frame(points, as_camera_view(view), 1.5)
    right, up, back = ((points - eye) @ as_camera_view(view).axes).T
    assert (back < 0).all()
    across, upward = right / -back, up / -back
    assert sides[0] < across.min() < across.max() < sides[1]
    assert sides[2] < upward.min() < upward.max() < sides[3]
    assert max(np.ptp(across) / (sides[1] - sides[0]), np.ptp(upward) / (sides[3] - sides[2])) > 0.95


def test_lookat_is_the_middle_of_the_picture_at_its_distance():
    view = as_camera_view("azimuth=90, elevation=-30, distance=2, lookat=0.1/0.2/0.3")
    eye, sides = view_frame(outline(ring_cell(2)), view, 1.0)
    assert np.linalg.norm(eye - [0.1, 0.2, 0.3]) == pytest.approx(2.0)
    assert sides[0] == -sides[1]
    assert sides[2] == -sides[3]


def test_views_differ_and_the_overview_is_the_usual_picture():
    cell = ring_cell(2)
    start = {arm.name: arm.robot.tucked for arm in cell.arms}

    def shots():
        out = []
        for camera in (None, "overview", "top", "azimuth=90,elevation=-90,distance=4"):
            with OffscreenRenderer(cell, 96, 72, fine=False, camera=camera) as renderer:
                out.append(renderer.picture(start))
        return out

    images = made(shots)
    if images is None:
        return
    usual, overview, top, far = images
    assert (usual == overview).all()
    assert (usual != top).any()
    assert (far != top).any()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("topp", ["topp", "Did you mean 'top'?"]),
        ("azimut=3,elevation=2", ["'azimut'", "Did you mean 'azimuth'?"]),
        ("azimuth=3", ["no elevation"]),
        ("azimuth=3,elevation=x", ["elevation of a camera is 'x'", "a number"]),
        ("azimuth=3,elevation=nan", ["elevation", "finite"]),
        ("azimuth=3,elevation=-91", ["elevation", "-91", "-90"]),
        ("azimuth=3,elevation=1,azimuth=4", ["azimuth twice"]),
        ("azimuth=3,elevation=1,distance=0", ["distance of a camera is 0", "above 0"]),
        ("azimuth=3,elevation=1,distance=1e9", ["distance", "40 at most"]),
        ("azimuth=3,elevation=1,distance=3,lookat=1/2", ["lookat", "3 finite numbers"]),
        ("azimuth=3,elevation=1,lookat=1/2/3", ["lookat needs a distance"]),
        ("azimuth=3,top", ["azimuth=3,top", "front"]),
        ("", ["camera view"]),
    ],
)
def test_a_view_that_is_none_is_refused_in_one_sentence(given, words):
    with pytest.raises(MmpError) as caught:
        as_camera_view(given)
    assert all(word in str(caught.value) for word in words)
    assert "\n" not in str(caught.value)
