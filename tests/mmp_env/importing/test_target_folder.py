"""Folders that an import must not write: links, inputs, files of the user, and folders below a file."""

import json

import pytest

from mmp_env.errors import MmpError
from mmp_env.importing.target_folder import TargetFolder

FILES = ("robot.json", "spheres.json", "hulls.json", "small.xml")


def robot_in(out):
    return TargetFolder(out=out, name="small", kind="robot", description="robot.json")


@pytest.fixture
def robot(tmp_path):
    """A folder with the files of an import."""
    folder = tmp_path / "small"
    folder.mkdir()
    for name in FILES:
        (folder / name).write_text("{}")
    return folder


def test_a_new_folder_and_an_earlier_import_may_be_written(tmp_path, robot):
    assert robot_in(tmp_path).checked([tmp_path / "arm.urdf"]) == robot
    assert robot_in(tmp_path / "new" / "deep").checked([]) == tmp_path / "new" / "deep" / "small"


@pytest.mark.parametrize("there", [True, False])
def test_a_link_is_refused_with_the_place_it_points_to(tmp_path, robot, there):
    (tmp_path / "out").mkdir()
    points = robot if there else tmp_path / "nothing"
    (tmp_path / "out" / "small").symlink_to(points)
    with pytest.raises(MmpError, match=f"small is a symbolic link to {points}; give another --name or --out"):
        robot_in(tmp_path / "out").checked([])


def test_out_may_be_a_link(tmp_path, robot):
    (tmp_path / "out").symlink_to(tmp_path)
    assert robot_in(tmp_path / "out").checked([]) == robot


@pytest.mark.parametrize("inside", ["small.xml", ".", "meshes/a.stl"])
def test_a_folder_that_holds_an_input_is_refused(tmp_path, robot, inside):
    with pytest.raises(MmpError, match=r"is an input and lies in .*small, which the import writes"):
        robot_in(tmp_path).checked([tmp_path / "arm.urdf", robot / inside])


def test_an_input_behind_a_link_is_refused(tmp_path, robot):
    (tmp_path / "arm.xml").symlink_to(robot / "small.xml")
    with pytest.raises(MmpError, match=r"arm\.xml is an input and lies in"):
        robot_in(tmp_path).checked([tmp_path / "arm.xml"])


@pytest.mark.parametrize("name", ["NOTES.md", "LICENSE", "meshes/a.stl", "other.xml", "hulls.json/a"])
def test_a_folder_with_files_that_no_import_wrote_is_refused(tmp_path, robot, name):
    path = robot / name
    if path.parent.is_file():
        path.parent.unlink()
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")
    with pytest.raises(MmpError, match=f"small holds {name.split('/')[0]}, which no import wrote"):
        robot_in(tmp_path).checked([])
    assert path.read_text() == "mine"


def test_a_file_that_was_replaced_by_a_link_is_refused(tmp_path, robot):
    (robot / "hulls.json").rename(tmp_path / "mine.json")
    (robot / "hulls.json").symlink_to(tmp_path / "mine.json")
    with pytest.raises(MmpError, match=r"holds hulls\.json, which no import wrote"):
        robot_in(tmp_path).checked([])


def test_only_the_folders_of_its_states_belong_to_a_tool(tmp_path):
    folder = tmp_path / "grip"
    for part in (folder / "open", folder / "closed"):
        part.mkdir(parents=True)
        (part / "tool.json").write_text("{}")
        (part / "grip.xml").write_text("<mujoco/>")
    (folder / "tool.json").write_text(json.dumps({"states": ["open", "closed"]}))
    place = TargetFolder(out=tmp_path, name="grip", kind="tool", description="tool.json")
    assert place.checked([]) == folder
    (folder / "open" / "NOTES.md").write_text("mine")
    with pytest.raises(MmpError, match=r"holds open/NOTES\.md, which"):
        place.checked([])
    (folder / "tool.json").write_text("{")
    with pytest.raises(MmpError, match="holds closed, which"):
        place.checked([])


@pytest.mark.parametrize("out", ["p.json", "p.json/deep"])
def test_out_below_a_file_is_refused(tmp_path, out):
    (tmp_path / "p.json").write_text("{}")
    with pytest.raises(MmpError, match=f"--out .*{out} must be a folder, and .*p.json is a file"):
        robot_in(tmp_path / out).checked([])
