"""`mmp robot add`, `show` and `check`: arms of the user's own, from file to plan."""

import json

import pytest
from support.small_arms import mjcf, urdf


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache of imports that all tests share."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def home(tmp_path, monkeypatch, cache):
    """The user's data folder, empty; the working directory."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    monkeypatch.setattr("mmp_cli.import_progress.FIRST_S", 1e6)  # no line on a slow machine
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(urdf())
    return tmp_path


def test_an_added_robot_is_listed_checked_and_planned_like_a_built_in_one(mmp, home):
    ran = mmp("robot", "add", "arm.urdf", "--name", "small", "--json")
    assert (ran.code, ran.err) == (0, "")
    told = ran.result
    assert (told["name"], told["joints"], told["links"], told["uncovered_mm"]) == ("small", 3, 4, 0)
    assert told["protrusion_mm"]["fine"] <= 5
    assert told["folder"] == str(home / "data" / "mmp-env" / "robots" / "small")
    assert "small" in [robot["name"] for robot in mmp("list", "--json").result["robots"]]
    ran = mmp("robot", "check", "small", "--json")
    assert (ran.code, ran.result["valid"], ran.result["faults"]) == (0, True, [])
    arms = [{"name": n, "robot": "small", "position": [x, 0, 0]} for n, x in (("a", -0.4), ("b", 0.4))]
    (home / "cell.json").write_text(json.dumps({"arms": arms}))
    ran = mmp("plan", "cell.json", "--out", "plan.json", "--execute", "--json")
    assert (ran.code, ran.result["valid"]) == (0, True)
    assert mmp("check", "plan.json").code == 0


def test_the_output_says_which_chain_was_taken(mmp, home):
    ran = mmp("robot", "add", "arm.urdf", "--name", "small", "--out", "robots")
    assert ran.code == 0
    assert "3 joints, base_link to tool0" in ran.out
    assert "turn, lift, roll" in ran.out
    assert "proved, 0 mm uncovered" in ran.out
    assert (home / "robots" / "small" / "hulls.json").exists()
    assert mmp("robot", "check", "robots/small").code == 0


def test_a_fault_in_a_robot_is_exit_1_and_every_fault(mmp, home):
    mmp("robot", "add", "arm.urdf", "--name", "small", "--out", "robots")
    path = home / "robots" / "small" / "spheres.json"
    path.write_text(path.read_text().replace("0.05", "0.03"))
    ran = mmp("robot", "check", "robots/small")
    assert ran.code == 1
    assert "spheres.json was changed after the import" in ran.out
    assert "uncovered" in ran.out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["add", "no.urdf", "--name", "x"], "no.urdf cannot be read: there is no such file"),
        (["add", "arm.urdf"], "--name"),
        (["add", "arm.urdf", "--name", "a/b"], "--name is a/b; it must be"),
        (["add", "arm.urdf", "--name", ".."], "--name is ..; it must be"),
        (["add", "arm.urdf", "--name", "panda"], "--name panda is the name of a robot in"),
        (["add", "arm.urdf", "--name", "x", "--tip", "toll0"], "Did you mean 'tool0'"),
        (["add", "arm.urdf", "--name", "x", "--package-dir", "no"], "--package-dir no is not a folder"),
        (["check", "nobody"], "unknown robot 'nobody'"),
        (["show", "nobody", "--image", "x.png"], "unknown robot 'nobody'"),
        (["shoe"], "unknown command of mmp robot 'shoe'. Did you mean 'show'"),
    ],
)
def test_misuse_is_one_sentence_and_writes_nothing(mmp, home, words, sentence):
    ran = mmp("robot", *words)
    assert (ran.code, ran.out) == (2, "")
    assert sentence in ran.err
    assert ran.err.count("\n") == 1
    assert sorted(path.name for path in home.iterdir()) == ["arm.urdf"]


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def add_twice(mmp, home):
    """Adds a robot, and returns its folder and a function that runs a further command on it."""
    mmp("robot", "add", "arm.urdf", "--name", "small", "--out", "mine")
    before = contents(home / "mine")

    def refused(*words, sentence):
        ran = mmp("robot", "add", *words, "--out", "mine")
        assert (ran.code, ran.out) == (2, "")
        assert sentence in ran.err
        assert ran.err.count("\n") == 1
        assert contents(home / "mine") == before

    return home / "mine" / "small", refused


def test_a_robot_behind_a_link_is_not_replaced(mmp, home):
    folder, refused = add_twice(mmp, home)
    (folder.parent / "other").symlink_to("small")
    (home / "other.xml").write_text(mjcf())
    refused("other.xml", "--name", "other", sentence="mine/other is a symbolic link to small; give another")


def test_a_robot_is_not_made_in_place_of_its_source(mmp, home):
    folder, refused = add_twice(mmp, home)
    refused("mine/small/small.xml", "--name", "small", sentence="mine/small/small.xml is an input and lies in")
    refused("arm.urdf", "--name", "small", "--package-dir", folder, sentence=f"{folder} is an input and lies in")


def test_files_of_the_user_in_a_robot_are_not_deleted(mmp, home):
    folder, _ = add_twice(mmp, home)
    (folder / "NOTES.md").write_text("mine")
    ran = mmp("robot", "add", "arm.urdf", "--name", "small", "--out", "mine")
    assert ran.code == 2
    assert "mine/small holds NOTES.md, which no import wrote and which would be lost" in ran.err
    assert (folder / "NOTES.md").read_text() == "mine"


def test_the_output_says_that_a_robot_is_replaced(mmp, home):
    words = ("robot", "add", "arm.urdf", "--name", "small", "--out", "mine")
    first, second, third = mmp(*words), mmp(*words), mmp(*words, "--json")
    assert (first.code, second.code, third.code) == (0, 0, 0)
    assert "replaced" not in first.out
    assert "the robot of this name that was in the folder" in second.out
    assert third.result["replaced"] is True


def test_out_that_is_a_file_is_refused(mmp, home):
    (home / "p.json").write_text("{}")
    ran = mmp("robot", "add", "arm.urdf", "--name", "small", "--out", "p.json")
    assert (ran.code, ran.err) == (2, "mmp: --out p.json must be a folder, and p.json is a file\n")


def test_several_package_folders_may_be_given(mmp, home):
    (home / "one").mkdir()
    (home / "two").mkdir()
    ran = mmp("robot", "add", "arm.urdf", "--name", "x", "--package-dir", "one", "--package-dir", "two")
    assert ran.code == 0


def test_an_arm_with_a_slide_is_imported_planned_and_checked(mmp, home):
    (home / "rail.xml").write_text(mjcf(joint2='type="slide" range="-0.1 0.4"'))
    assert mmp("robot", "add", "rail.xml", "--name", "rail").code == 0
    (home / "cell.json").write_text(json.dumps({"arms": [{"name": "a", "robot": "rail", "position": [0, 0, 0]}]}))
    ran = mmp("plan", "cell.json", "--out", "plan.json")
    assert ran.code == 0, ran.err
    assert mmp("check", "plan.json").code == 0


def test_a_picture_shows_geometry_and_spheres(mmp, home):
    mmp("robot", "add", "arm.urdf", "--name", "small")
    ran = mmp("robot", "show", "small", "--image", "small.png")
    if ran.code == 2 and "OpenGL" in ran.err:
        pytest.skip("no OpenGL library")
    assert ran.code == 0
    from PIL import Image

    with Image.open(home / "small.png") as image:
        assert image.width > 3 * 400
