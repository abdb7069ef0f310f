"""Pictures of plans: their content, tool paths, files, and the message if no picture can be made."""

import numpy as np
import pytest
from PIL import Image
from support import tiny_plans
from support.picture_or_sentence import NONE_HERE, made, pixels_of_arm, without_libraries
from support.unchecked import unchecked

from mmp_env import line_cell, ring_cell
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.sim.camera_view import CameraView
from mmp_env.sim.scene_appearance import CAMERA, frame, outline
from mmp_env.sim.simulation import Simulation
from mmp_env.view.offscreen_renderer import HEIGHT, OffscreenRenderer, fitting_height, tool_path_lines
from mmp_env.view.pictures import check_picture, encoded, labelled, picture, pictures, save_picture

SMALL = {"width": 160, "height": 120}


@pytest.fixture(scope="module")
def plan():
    return plan_from_dict(tiny_plans.two_apart())


@pytest.fixture
def no_library(monkeypatch):
    with without_libraries(monkeypatch):
        yield


@pytest.mark.parametrize("count", [2, 8])
def test_a_picture_of_a_cell_has_every_arms_colour_and_more(count):
    cell = ring_cell(count)

    def shoot():
        with OffscreenRenderer(cell, 320, 240) as renderer:
            return renderer.picture({arm.name: arm.robot.tucked for arm in cell.arms})

    image = made(shoot)
    if image is None:
        return
    assert image.shape == (240, 320, 3)
    assert image.std() > 10
    assert all(pixels_of_arm(image, number) > 30 for number in range(count))
    assert (shoot() == image).all()


def test_moments_stand_side_by_side_and_differ(plan):
    image = made(lambda: pictures(plan, **SMALL))
    if image is None:
        return
    assert image.shape == (120, 3 * 160 + 2 * 4, 3)
    first, second, third = (image[:, k : k + 160].astype(int) for k in (0, 164, 328))
    assert (first != second).any(axis=2).mean() > 0.01
    assert (second != third).any(axis=2).mean() > 0.01
    assert (pictures(plan, [0.0], **SMALL) != image[:, :160]).any()  # a time has no name
    assert pictures(plan, [0.0], **SMALL).shape == (120, 160, 3)


def test_a_picture_shows_goals_and_tool_paths_on_request(plan):
    choices = (False, False), (True, False), (False, True)
    images = made(lambda: [picture(plan, "start", width=320, height=240, goals=g, tool_paths=w) for g, w in choices])
    if images is None:
        return
    bare, *others = (image.astype(int) for image in images)
    assert all((other != bare).any(axis=2).sum() > 50 for other in others)
    end = [picture(plan, plan.makespan_s, **SMALL, goals=goals, tool_paths=False) for goals in (False, True)]
    assert (end[0] == end[1]).all()  # the arms hide the ghosts


def test_tool_paths_follow_the_tools_and_are_fainter_after_the_moment(plan):
    time_s = 0.4 * plan.makespan_s
    lines = tool_path_lines(plan, time_s)
    assert len(lines) == 4
    assert [line.rgba[3] == 1.0 for line in lines] == [True, False] * 2
    passed, ahead = lines[:2]
    ends = plan.at(0.0)["left"], plan.at(time_s)["left"], plan.at(plan.makespan_s)["left"]
    points = plan.problem.cell.collision.tool_points("left", np.array(ends))
    assert passed.points[[0, -1]] == pytest.approx(points[:2], abs=1e-9)
    assert ahead.points[[0, -1]] == pytest.approx(points[1:], abs=1e-9)
    before = plan.problem.cell.collision.tool_points("left", plan.at(0.2 * plan.makespan_s)["left"][None])[0]
    assert distance(before, passed.points) < 0.006


def distance(point, polyline):
    """Returns the distance of a point from a polyline."""
    begin, along = polyline[:-1], np.diff(polyline, axis=0)
    share = np.clip(((point - begin) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return np.linalg.norm(begin + share[:, None] * along - point, axis=1).min()


@pytest.mark.parametrize("aspect", [0.5, 4 / 3, 2.4])
def test_a_picture_of_any_shape_holds_the_cell(aspect):
    cell = ring_cell(4)
    camera = Simulation(cell).data.camera(CAMERA)
    points = outline(cell)
    left, right, bottom, top = frame(points, camera.xpos, camera.xmat.reshape(3, 3), aspect)
    across, up, back = ((points - camera.xpos) @ camera.xmat.reshape(3, 3)).T
    assert ((left < across / -back) & (across / -back < right)).all()
    assert ((bottom < up / -back) & (up / -back < top)).all()
    assert (right - left) / (top - bottom) == pytest.approx(aspect)


@pytest.mark.parametrize(
    ("suffix", "format"), [(".png", "PNG"), (".JPG", "JPEG"), (".jpeg", "JPEG"), (".webp", "WEBP")]
)
def test_the_suffix_says_what_a_file_is(plan, tmp_path, suffix, format):
    path = tmp_path / f"plan{suffix}"
    made(lambda: save_picture(plan, path, **SMALL, fine=False))
    if path.exists():
        with Image.open(path) as image:
            assert (image.format, image.size) == (format, (488, 120))
    assert list(tmp_path.iterdir()) in ([path], [])


@pytest.mark.parametrize(
    ("name", "message"),
    [("plan.pmg", "suffix of a picture '.pmg'. Did you mean '.png'"), ("plan", "Known: .jpeg, .jpg, .png, .webp")],
)
def test_an_unknown_suffix_is_refused_with_those_that_exist(plan, tmp_path, name, message):
    for call in (lambda: check_picture(tmp_path / name), lambda: save_picture(plan, tmp_path / name)):
        with pytest.raises(UnknownNameError) as caught:
            call()
        assert message in str(caught.value)


def test_impossible_arguments_are_one_sentence(plan, tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean 'middle'"):
        picture(plan, "midle")
    with pytest.raises(MmpError, match="moment is 99 s; the plan goes from 0 to"):
        picture(plan, 99)
    with pytest.raises(MmpError, match="a picture of 101 moments was asked for; it has 100 at most"):
        check_picture(tmp_path / "plan.png", [0.0] * 101)
    with pytest.raises(MmpError, match="at least one moment"):
        pictures(plan, ())
    with pytest.raises(MmpError, match=r"moments is 'end'; it must be a list of moments, such as \['end'\]"):
        check_picture(tmp_path / "plan.png", "end")
    with unchecked(), pytest.raises(MmpError, match=r"moments is 2\.5; it must be a list"):
        pictures(plan, 2.5)
    with pytest.raises(MmpError, match="width is 0"):
        picture(plan, width=0)
    with pytest.raises(MmpError, match=f"cannot be written|{NONE_HERE}"):
        check_picture(tmp_path / "nowhere" / "plan.png")


@pytest.mark.usefixtures("no_library")
def test_without_a_library_the_package_is_named_before_anything_is_made(plan, tmp_path):
    for call in (lambda: check_picture(tmp_path / "a.png"), lambda: save_picture(plan, tmp_path / "a.png")):
        with pytest.raises(MmpError, match=r"neither EGL nor OSMesa .*libegl1 libgl1"):
            call()
    assert list(tmp_path.iterdir()) == []


def test_a_label_is_in_the_corner_and_nowhere_else():
    plain = np.full((120, 160, 3), 200, np.uint8)
    changed = (labelled(plain, "middle, 1.0 s") != plain).any(axis=2)
    assert changed[:30].sum() > 20
    assert not changed[30:].any()
    assert (plain == 200).all()


@pytest.mark.parametrize(("format", "width"), [("WEBP", 16_384), ("JPEG", 65_536)])
def test_a_picture_that_is_too_wide_for_its_format_is_one_sentence(format, width):
    with pytest.raises(MmpError, match=f"{format} cannot hold a picture of {width} x 1 pixels"):
        encoded(np.zeros((1, width, 3), np.uint8), format)


def test_the_height_of_a_picture_follows_a_wide_cell():
    wide, ring = outline(line_cell(48)), outline(ring_cell(8))
    assert fitting_height(ring, 640) == HEIGHT
    height = fitting_height(wide, 640)
    assert 64 < height < 240
    assert height % 2 == 0
    assert fitting_height(wide, 640, "left") == HEIGHT  # along the rows
    assert fitting_height(wide, 640, "top") < height
    assert fitting_height(wide, 640, CameraView(azimuth=90, elevation=-30, distance=3.0)) == HEIGHT


def test_wide_pictures_stand_below_each_other(plan):
    image = made(lambda: pictures(plan, width=160, height=60))
    if image is None:
        return
    assert image.shape == (3 * 60 + 2 * 4, 160, 3)
