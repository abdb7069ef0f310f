"""`--tree`, `--rerun`, `--image` and `--video` of `mmp plan`: what they write, and how they fail."""

import os
import re
import sys
import xml.etree.ElementTree as ElementTree

import pytest
from support.refusals import assert_refused

import mmp_cli.visual_outputs
import mmp_env.check
from mmp_cli.visual_outputs import CombinedWatcher
from mmp_env.errors import MmpError
from mmp_env.events import SearchStarted
from mmp_env.view import films, pictures
from mmp_env.view.search_tree import SearchTree
from mmp_planners import StopPlanning


def nodes(path):
    return len(re.findall("data-node=", path.read_text(encoding="utf-8")))


@pytest.fixture
def stand_in_pictures(monkeypatch):
    """Replaces pictures and films by a line of text with their arguments."""

    def save_picture(plan, path, *, moments, camera):
        write(path, f"picture {plan.makespan_s:.3f} {list(moments)}")

    def save_film(plan, path, report, *, camera, progress):
        progress(1, 1)
        write(path, f"film {plan.makespan_s:.3f} executed {report.duration_s:.3f}")

    def write(path, text):
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    monkeypatch.setattr(pictures, "save_picture", save_picture)
    monkeypatch.setattr(films, "save_film", save_film)


def test_all_four_are_written_and_reported(mmp, instances, tmp_path):
    files = {"tree": "tree.svg", "rerun": "search.rrd", "image": "plan.png", "video": "plan.gif"}
    options = [word for name, file in files.items() for word in (f"--{name}", tmp_path / file)]
    ran = mmp("plan", instances, "--planner", "ecbs", *options)
    assert (ran.code, ran.err) == (0, "")
    for row, file in zip(("tree", "recording", "picture", "film"), files.values(), strict=True):
        assert re.search(rf"^{row} +\S*{file}", ran.out, re.MULTILINE)
    assert sorted(os.listdir(tmp_path)) == sorted([*files.values(), "pairs.json"])
    assert ElementTree.parse(tmp_path / "tree.svg").getroot()[0].text.startswith("ecbs on pair/turn, seed 0: ")
    assert (tmp_path / "search.rrd").read_bytes()[:4] == b"RRF2"
    assert (tmp_path / "plan.png").read_bytes()[1:4] == b"PNG"
    assert (tmp_path / "plan.gif").read_bytes()[:4] == b"GIF8"


def test_watching_changes_no_plan(mmp, tmp_path):
    asked = ("plan", "MultiArmCell-2", "--planner", "apf-ecbs", "--seed", 5)
    assert mmp(*asked, "--out", tmp_path / "alone.json").code == 0
    watched = ("--tree", tmp_path / "tree.svg", "--rerun", tmp_path / "search.rrd", "--out", tmp_path / "watched.json")
    assert mmp(*asked, *watched).code == 0
    assert (tmp_path / "alone.json").read_bytes() == (tmp_path / "watched.json").read_bytes()


def test_the_film_shows_an_execution_with_and_without_execute(mmp, stand_ins, stand_in_pictures, instances, tmp_path):
    film = tmp_path / "plan.mp4"
    ran = mmp("plan", instances, "--planner", "straight", "--video", film, "--json")
    assert "execution" not in ran.result
    said = film.read_text()
    assert mmp("plan", instances, "--planner", "straight", "--video", film, "--json", "--execute").result["execution"]
    assert film.read_text() == said
    assert "executed" in said


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        ([], "['start', 'middle', 'end']"),
        (["--moments", "end"], "['end']"),
        (["--moments", "0.5, start"], "[0.5, 'start']"),
    ],
    ids=["all three", "one", "two"],
)
def test_a_picture_shows_the_requested_moments(mmp, stand_ins, stand_in_pictures, instances, tmp_path, asked, shown):
    picture = tmp_path / "plan.png"
    assert mmp("plan", instances, "--planner", "straight", "--image", picture, *asked).code == 0
    assert picture.read_text().endswith(shown)


@pytest.mark.parametrize("planner", ["straight", "sorry", "liar"])
def test_a_planner_without_a_tree_gets_a_drawing_all_the_same(mmp, stand_ins, instances, tmp_path, planner):
    mmp("plan", instances, "--planner", planner, "--tree", tmp_path / "tree.svg")
    assert nodes(tmp_path / "tree.svg") == (planner != "sorry")
    assert ElementTree.parse(tmp_path / "tree.svg").getroot()[0].text.startswith(f"{planner} on pair/turn, seed 0: ")


def test_pictures_and_films_get_the_camera(mmp, stand_ins, instances, tmp_path, monkeypatch):
    cameras = []
    monkeypatch.setattr(pictures, "save_picture", lambda plan, path, *, moments, camera: cameras.append(camera))
    monkeypatch.setattr(films, "save_film", lambda plan, path, report, *, camera, progress: cameras.append(camera))
    options = ["--image", tmp_path / "p.png", "--video", tmp_path / "v.gif", "--camera", "azimuth=30,elevation=-20"]
    assert mmp("plan", instances, "--planner", "straight", *options).code == 0
    assert cameras == ["azimuth=30,elevation=-20"] * 2


def test_without_a_plan_there_is_a_tree_and_no_picture(mmp, stand_ins, stand_in_pictures, instances, tmp_path):
    options = ["--tree", tmp_path / "t.svg", "--image", tmp_path / "p.png", "--video", tmp_path / "v.gif"]
    ran = mmp("plan", instances, "--planner", "helpless", *options)
    assert (ran.code, ran.err) == (1, "")
    assert ran.out.count("none, as there is no plan") == 2
    assert sorted(os.listdir(tmp_path)) == ["pairs.json", "t.svg"]


def test_ctrl_c_keeps_the_tree_and_leaves_out_the_pictures(mmp, stand_ins, stand_in_pictures, instances, tmp_path):
    options = ["--tree", tmp_path / "t.svg", "--image", tmp_path / "p.png", "--video", tmp_path / "v.gif"]
    ran = mmp("plan", instances, "--planner", "interrupted", *options)
    assert ran.code == 130
    assert len(re.findall("^(?:picture|film) +left out, the run was interrupted", ran.out, re.MULTILINE)) == 2
    assert nodes(tmp_path / "t.svg") == 1
    assert sorted(os.listdir(tmp_path)) == ["pairs.json", "t.svg"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--tree", "tree.png"], ["--tree", "'tree.png'", ".svg"]),
        (["--tree", "none/tree.svg"], ["none/tree.svg cannot be written: No such file"]),
        (["--rerun", "search.rerun"], ["'search.rerun'", ".rrd", "spawn"]),
        (["--rerun", "none/search.rrd"], ["none/search.rrd cannot be written: No such file"]),
        (["--rerun", "spawn"], ["no display", ".rrd"]),
        (["--image", "plan.bmp"], ["'.bmp'", ".png"]),
        (["--image", "plan.png", "--moments", "start,midle"], ["'midle'", "Did you mean 'middle'?"]),
        (["--image", "plan.png", "--moments", "-1"], ["-1", "begins at 0"]),
        (["--moments", "start"], ["--moments", "--image FILE"]),
        (["--image", "plan.png", "--camera", "topp"], ["--camera", "'topp'", "Did you mean 'top'?"]),
        (["--video", "plan.gif", "--camera", "azimuth=3"], ["--camera", "no elevation"]),
        (["--camera", "top"], ["--camera", "--image and --video"]),
        (["--image", "none/plan.png"], ["none/plan.png cannot be written: No such file"]),
        (["--video", "plan.avi"], ["'.avi'", ".mp4", ".gif"]),
        (["--video", "none/plan.gif"], ["none/plan.gif cannot be written: No such file"]),
        (["--tree", "a.svg", "--out", "./a.svg"], ["--out and --tree both name a.svg"]),
        (["--image", "a.webp", "--video", "a.webp"], ["--image and --video both name a.webp"]),
        (["--tree"], ["--tree", "expected one argument"]),
        (["--tre", "a.svg"], ["'--tre'", "Did you mean '--tree'?"]),
    ],
    ids=lambda value: " ".join(value)[:40] if value[0].startswith("--") else "",
)
def test_bad_usage_is_found_before_planning(mmp, stand_ins, instances, tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert_refused(mmp("plan", instances, "--planner", "straight", *options), *words)
    assert stand_ins.Straight.calls == []
    assert os.listdir(tmp_path) == ["pairs.json"]


def test_a_missing_package_is_named_before_planning(mmp, stand_ins, instances, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    ran = mmp("plan", instances, "--planner", "straight", "--rerun", tmp_path / "search.rrd")
    assert_refused(ran, "rerun-sdk", "pip install 'mmp-env[rerun]'")
    assert stand_ins.Straight.calls == []
    assert os.listdir(tmp_path) == ["pairs.json"]


@pytest.mark.parametrize("option", [("--image", "plan.png"), ("--video", "plan.gif")], ids=lambda option: option[0])
def test_forbidden_pictures_are_reported_before_planning(mmp, stand_ins, instances, tmp_path, monkeypatch, option):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    ran = mmp("plan", instances, "--planner", "straight", option[0], tmp_path / option[1])
    assert_refused(ran, "MUJOCO_GL is disable")
    assert stand_ins.Straight.calls == []


def test_a_viewer_that_fails_costs_no_plan_and_is_named(mmp, stand_ins, instances, tmp_path, monkeypatch):
    def broken(self, event):
        raise KeyError("a bug")

    monkeypatch.setattr(SearchTree, "__call__", broken)
    ran = mmp("plan", instances, "--planner", "straight", "--tree", tmp_path / "t.svg", "--json")
    assert (ran.code, ran.result["status"], ran.result["valid"]) == (2, "solved", True)
    assert ran.err == "mmp: --tree: it stopped at KeyError: 'a bug'\n"


def test_a_file_that_cannot_be_written_in_the_end_costs_no_summary(mmp, stand_ins, instances, tmp_path, monkeypatch):
    def full(plan, path, moments, camera):
        raise MmpError(f"{path} cannot be written: No space left on device")

    monkeypatch.setattr(mmp_cli.visual_outputs, "save_image", full)
    options = ["--tree", tmp_path / "t.svg", "--image", tmp_path / "p.png"]
    ran = mmp("plan", instances, "--planner", "straight", *options)
    assert ran.code == 2
    assert ran.err == f"mmp: --image: {tmp_path / 'p.png'} cannot be written: No space left on device\n"
    assert "valid; clearance" in ran.out
    assert nodes(tmp_path / "t.svg") == 1


def test_a_viewer_that_breaks_down_in_the_end_costs_no_summary(mmp, stand_ins, instances, tmp_path, monkeypatch):
    def broken(self):
        raise KeyError("a bug")

    monkeypatch.setattr(SearchTree, "svg", broken)
    ran = mmp("plan", instances, "--planner", "straight", "--tree", tmp_path / "t.svg", "--json")
    assert (ran.code, ran.result["status"], ran.result["valid"]) == (2, "solved", True)
    assert ran.err == "mmp: --tree: it failed with KeyError: 'a bug'\n"
    assert os.listdir(tmp_path) == ["pairs.json"]


def test_a_recording_of_nothing_is_made_too(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--planner", "helpless", "--rerun", tmp_path / "s.rrd")
    assert (ran.code, ran.err) == (1, "")
    assert (tmp_path / "s.rrd").read_bytes()[:4] == b"RRF2"


def test_a_recording_says_that_it_ends_where_the_run_failed(mmp, stand_ins, instances, tmp_path, monkeypatch):
    def no_memory(document):
        raise MemoryError

    monkeypatch.setattr(mmp_env.check, "check_document", no_memory)
    path = tmp_path / "s.rrd"
    ran = mmp("plan", instances, "--planner", "straight", "--rerun", path)
    assert ran.code == 2
    assert ran.err == f"mmp: the recording {path} ends where the run failed\nmmp: there is not enough memory\n"
    assert path.read_bytes()[:4] == b"RRF2"


def test_ctrl_c_before_the_recording_is_written_leaves_it_out(mmp, stand_ins, instances, tmp_path, monkeypatch):
    def interrupted(self, path):
        raise KeyboardInterrupt

    monkeypatch.setattr(SearchTree, "save", interrupted)
    path = tmp_path / "s.rrd"
    ran = mmp("plan", instances, "--planner", "straight", "--tree", tmp_path / "t.svg", "--rerun", path)
    assert ran.code == 130
    assert ran.err == "mmp: interrupted\n"
    assert os.listdir(tmp_path) == ["pairs.json"]


def test_an_invalid_instance_leaves_no_file(mmp, stand_ins, instances, tmp_path):
    ran = mmp("plan", instances, "--instance", "outside", "--tree", tmp_path / "t.svg", "--rerun", tmp_path / "s.rrd")
    assert_refused(ran, "joint 3")
    assert os.listdir(tmp_path) == ["pairs.json"]


def test_combined_watchers_get_every_event_in_turn_and_each_can_stop():
    heard, (one, other) = [], (SearchStarted(elapsed_s=0.0, restart=k, sub_seed=0) for k in range(2))

    def stops(event):
        heard.append(("b", event))
        if event is other:
            raise StopPlanning

    class Wants:
        wants_iterates = True

        def __call__(self, event):
            heard.append(("c", event))

    together = CombinedWatcher(lambda event: heard.append(("a", event)), stops, Wants())
    together(one)
    with pytest.raises(StopPlanning):
        together(other)
    assert heard == [("a", one), ("b", one), ("c", one), ("a", other), ("b", other)]
    assert together.wants_iterates
    assert not CombinedWatcher(stops).wants_iterates
