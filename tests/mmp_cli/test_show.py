"""`mmp show`: the program that opens each kind of file, and the messages if none can."""

import itertools
import json
import os
import sys
import webbrowser

import pytest
from support import tiny_plans
from support.refusals import assert_refused

import mmp_cli.show
from mmp_env.sim import rendering
from mmp_env.view import episode_film


@pytest.fixture
def no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def display(monkeypatch):
    """Returns a list of everything that is opened on a display."""
    monkeypatch.setenv("DISPLAY", ":0")
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda uri: opened.append(uri) or True)

    class Done:
        returncode = 0

    monkeypatch.setattr(mmp_cli.show.subprocess, "run", lambda words, check: opened.append(words) or Done)
    return opened


def file(path, text="something"):
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", ["tree.svg", "plan.png", "film.mp4", "report.html", "FILM.GIF"])
def test_pictures_films_and_pages_open_in_the_browser(mmp, display, tmp_path, name):
    path = file(tmp_path / name)
    assert mmp("show", path).code == 0
    assert display == [path.as_uri()]


def test_a_recording_opens_in_the_viewer(mmp, display, tmp_path):
    path = file(tmp_path / "search.rrd")
    assert mmp("show", path).code == 0
    assert display == [[sys.executable, "-m", "rerun", str(path)]]


def test_a_plan_is_played_until_its_window_is_closed(mmp, display, plan, monkeypatch):
    shown = []

    class Window:
        def __init__(self, simulation):
            self.simulation, self.rounds = simulation, iter([True, True, False])

        @property
        def is_open(self):
            return next(self.rounds)

        def show(self, target):
            shown.append((self.simulation.data.time, target))

        def close(self):
            shown.append("closed")

    monkeypatch.setattr(rendering, "Window", Window)
    monkeypatch.setattr(mmp_cli.show, "_PAUSE_S", 0.0)
    ran = mmp("show", plan)
    assert ran.code == 0
    assert f"playing {plan}" in ran.out
    assert shown.pop() == "closed"
    times = [time_s for time_s, _ in shown]
    assert sum(b < a for a, b in itertools.pairwise(times)) == 1  # it is played twice
    assert all(len(target) == 12 for _, target in shown)


def test_the_report_of_a_benchmark_is_made_when_it_is_missing_or_old(mmp, display, tmp_path, monkeypatch):
    import mmp_cli.report

    made = []

    def report(args):
        made.append(args.folder)
        file(tmp_path / "report.html")
        return 0

    monkeypatch.setattr(mmp_cli.report, "run", report)
    file(tmp_path / "results.jsonl")
    assert mmp("show", tmp_path).code == 0
    assert (made, display) == ([str(tmp_path)], [(tmp_path / "report.html").as_uri()])
    assert mmp("show", tmp_path).code == 0
    assert len(made) == 1
    os.utime(tmp_path / "report.html", (0, 0))
    assert mmp("show", tmp_path).code == 0
    assert len(made) == 2


def test_pictures_and_a_recording_are_made_of_a_plan_without_a_display(mmp, no_display, plan, tmp_path):
    options = ["--image", tmp_path / "p.png", "--rerun", tmp_path / "s.rrd"]
    ran = mmp("show", plan, *options)
    assert ran.code == 0
    assert ran.out.splitlines() == [str(tmp_path / "s.rrd"), str(tmp_path / "p.png")]
    assert (tmp_path / "p.png").read_bytes()[1:4] == b"PNG"
    assert (tmp_path / "s.rrd").read_bytes()[:4] == b"RRF2"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("tree.svg", ["no display", "copy it"]),
        ("search.rrd", ["no display", "rerun.io/viewer"]),
        ("plan.json", ["no display", "--image FILE.png", "--rerun"]),
    ],
)
def test_without_a_display_a_message_names_an_alternative(mmp, no_display, tmp_path, plan, name, words):
    path = plan if name == "plan.json" else file(tmp_path / name)
    assert_refused(mmp("show", path), str(path), *words)


def test_a_browser_that_is_named_needs_no_display(mmp, no_display, tmp_path, monkeypatch):
    monkeypatch.setenv("BROWSER", "true")
    monkeypatch.setattr(webbrowser, "open", lambda uri: True)
    assert mmp("show", file(tmp_path / "tree.svg")).code == 0
    monkeypatch.setattr(webbrowser, "open", lambda uri: False)
    assert_refused(mmp("show", tmp_path / "tree.svg"), "no browser", "BROWSER")


def test_a_display_that_does_not_answer_is_reported(mmp, no_display, plan, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(rendering, "display_answers", lambda: False)
    assert_refused(mmp("show", plan), "does not answer", "--image")


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["none.json"], ["none.json cannot be opened", "no such file"]),
        (["."], ["no folder of mmp bench", "results.jsonl"]),
        (["{plan}", "--image", "p.bmp"], ["'.bmp'", ".png"]),
        (["{plan}", "--image", "p.png", "--video", "./p.png"], ["both name"]),
        (["{plan}", "--moments", "end"], ["--moments", "--image FILE"]),
        (["{svg}", "--image", "p.png"], ["--image shows a plan", "is none"]),
        (["{instances}", "--image", "p.png"], ["pairs.json is an instance file; `mmp show` takes plans"]),
        (["{plan}", "--tree", "t.svg"], ["unknown option", "'--tree'"]),
        ([], ["FILE"]),
    ],
    ids=lambda value: " ".join(value)[:30] if value and "." in value[0] else "",
)
def test_things_that_cannot_be_shown_are_one_sentence(
    mmp, display, plan, instances, tmp_path, monkeypatch, argv, words
):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    places = {"{plan}": plan, "{instances}": instances, "{svg}": file(tmp_path / "t.svg")}
    assert_refused(mmp("show", *(places.get(word, word) for word in argv)), *words)
    assert display == []
    assert os.listdir(tmp_path / "empty") == []


@pytest.fixture
def episode(tmp_path):
    data = {"schema": "mmp-episode/1", "plans": [tiny_plans.two_apart(), tiny_plans.two_apart()]}
    return file(tmp_path / "episode.json", json.dumps(data))


def test_an_episode_is_filmed(mmp, episode, tmp_path, monkeypatch):
    filmed = []
    monkeypatch.setattr(
        episode_film, "save_episode_film", lambda read, path, *, camera: filmed.append((len(read.plans), path, camera))
    )
    path = str(tmp_path / "film.gif")
    ran = mmp("show", episode, "--video", path, "--camera", "top")
    assert ran.code in (0, 2), ran.err  # 2 where no OpenGL library is found
    assert filmed == ([(2, path, "top")] if ran.code == 0 else [])


@pytest.mark.parametrize("option", ["--image", "--rerun"])
def test_an_episode_has_no_picture_of_one_plan(mmp, episode, tmp_path, option):
    target = tmp_path / {"--image": "plan.png", "--rerun": "plan.rrd"}[option]
    assert_refused(mmp("show", episode, option, target), option)
    assert not target.exists()


def test_without_a_display_an_episode_is_not_played(mmp, episode, no_display):
    assert_refused(mmp("show", episode), "no display", "--video FILE.mp4")
