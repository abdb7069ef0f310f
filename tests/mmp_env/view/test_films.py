"""Films of plans and of executions: frames, duration, files, errors and interruptions."""

import dataclasses
import gc
import os
import re
import subprocess
import sys
import weakref

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image
from support import tiny_plans
from support.picture_or_sentence import NONE_HERE, made, pixels_of_arm

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.view import animation, ffmpeg
from mmp_env.view.animation import GifEncoder, WebpEncoder
from mmp_env.view.films import HOLD_S, check_film, frame_times, frames, save_film

pytestmark = pytest.mark.filterwarnings("ignore::mmp_env.errors.UnretimedPlanWarning")

TINY = {"width": 96, "height": 64, "fine": False}


@pytest.fixture(scope="module")
def plan():
    return plan_from_dict(tiny_plans.two_apart())


@pytest.fixture(scope="module")
def report(plan):
    env = MultiArmCellEnv(cell=plan.problem.cell)
    env.reset(options={"start": plan.problem.start, "goal": plan.problem.goal})
    return env.execute(plan)


def test_frames_have_equal_steps_and_the_last_is_not_before_the_end():
    assert frame_times(1.0, 4).tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert frame_times(1.1, 4)[-1] == 1.25
    assert frame_times(0.0, 25).tolist() == [0.0]


def test_an_mp4_plays_everywhere_in_real_time(plan, report, tmp_path):
    path = tmp_path / "film.mp4"
    seen = []
    made(lambda: save_film(plan, path, report, fps=4, **TINY, progress=lambda *message: seen.append(message)))
    if not path.exists():
        return
    facts, images = read_back(path)
    count = len(frame_times(report.duration_s, 4))
    assert seen == [(k + 1, count) for k in range(count)]
    assert all(fact in facts for fact in ("h264", "yuv420p", "96x64", "4 fps"))
    assert len(images) == count + round(4 * HOLD_S)
    minutes, seconds = re.search(r"Duration: 00:(\d\d):([\d.]+)", facts).groups()
    assert 60 * int(minutes) + float(seconds) == pytest.approx(len(images) / 4, abs=0.02)
    assert 0 <= len(images) / 4 - report.duration_s - HOLD_S <= 0.51
    assert np.abs(images[0].astype(int) - images[-1]).mean() > 0.5
    assert all(pixels_of_arm(images[0], number) > 10 for number in range(2))
    assert list(tmp_path.iterdir()) == [path]


def read_back(path):
    """Returns ffmpeg's report about a film, and its frames."""
    words = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:"]
    done = subprocess.run(words, capture_output=True, check=True)
    return done.stderr.decode(), np.frombuffer(done.stdout, np.uint8).reshape(-1, 64, 96, 3)


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_a_film_for_pages_plays_for_ever_and_in_real_time(plan, tmp_path, suffix):
    path = tmp_path / f"film{suffix}"
    made(lambda: save_film(plan, path, fps=3, **TINY))
    if not path.exists():
        return
    with Image.open(path) as film:
        durations = []
        for k in range(film.n_frames):
            film.seek(k)
            film.load()
            durations.append(film.info["duration"])
        assert film.size == (96, 64)
        assert film.info["loop"] == 0
        last = np.array(film.convert("RGB")).astype(int)
    times = frame_times(plan.makespan_s, 3)
    assert len(durations) == len(times)
    assert sum(durations) == pytest.approx(1e3 * (times[-1] + 1 / 3 + HOLD_S), abs=10)
    *_, shown = frames(plan, fps=3, **TINY)
    assert np.abs(last - shown).mean() < 6


@pytest.mark.parametrize(("kind", "most"), [(GifEncoder, 12), (WebpEncoder, 25)])
@pytest.mark.parametrize("held", [1, 4, 100])
def test_a_long_film_is_written_while_it_is_made(kind, most, held, tmp_path, monkeypatch):
    """The film shows a moving square. At most the frames of one block are in memory."""
    size = (24, 40, 3)
    monkeypatch.setattr(animation, "_BLOCK_BYTES", held * np.prod(size))
    alive, shown = [], []
    with kind(tmp_path / "film", size[1], size[0], 10.0) as encoder:
        for k in range(17):
            frame = np.full(size, (230, 230, 240), np.uint8)
            frame[8:16, 2 * k : 2 * k + 8] = (200, 40, 20)
            shown.append(frame.astype(int))
            alive.append(weakref.ref(frame))
            encoder.add(frame)
            del frame
            assert sum(ref() is not None for ref in alive) <= held
        encoder.finish(HOLD_S)
    with Image.open(tmp_path / "film") as film:
        assert (film.n_frames, film.size, film.info["loop"]) == (17, (40, 24), 0)
        for k, expected in enumerate(shown):
            film.seek(k)
            assert np.abs(np.array(film.convert("RGB")).astype(int) - expected).mean() < most
            assert film.info["duration"] == 100 + (1000 if k == 16 else 0)


@pytest.mark.parametrize("kind", [GifEncoder, WebpEncoder])
def test_a_film_in_which_nothing_moves_lasts_as_long_as_it_should(kind, tmp_path):
    with kind(tmp_path / "film", 8, 6, 10.0) as encoder:
        for _ in range(5):
            encoder.add(np.full((6, 8, 3), 90, np.uint8))
        encoder.finish(HOLD_S)
    total = 0
    with Image.open(tmp_path / "film") as film:
        for k in range(film.n_frames):
            film.seek(k)
            film.load()
            total += film.info["duration"]
    assert total == 1500


@pytest.mark.parametrize("name", ["film.mp4", "film.gif"])
def test_a_broken_number_of_pixels_is_one_sentence(name, tmp_path):
    """The call runs in another process, without the type checks of the tests."""
    code = (
        "from support import tiny_plans; from mmp_env import MmpError, save_film\n"
        "from mmp_env.files.plan_file import plan_from_dict\n"
        f"try: save_film(plan_from_dict(tiny_plans.two_apart()), {str(tmp_path / name)!r}, width=64.5)\n"
        "except MmpError as error: print(error)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.path.dirname(__file__) + "/../.."}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert re.search(f"^width is 64.5; |{NONE_HERE}", done.stdout)
    assert list(tmp_path.iterdir()) == []


def test_a_film_shows_what_was_executed_or_what_was_planned(plan, report):
    late = dataclasses.replace(report, positions={name: q[::-1] for name, q in report.positions.items()})
    planned = made(lambda: list(frames(plan, fps=2, **TINY)))
    if planned is None:
        return
    backwards = list(frames(plan, late, fps=2, **TINY))
    assert len(planned) == len(frame_times(plan.makespan_s, 2))
    assert np.abs(planned[0].astype(int) - backwards[-1]).mean() < 0.5
    assert np.abs(planned[0].astype(int) - backwards[0]).mean() > 0.5


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_an_interruption_leaves_neither_file_nor_process(plan, tmp_path, suffix, monkeypatch):
    (tmp_path / f"film{suffix}").write_text("what was there before")
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[-1])

    def interrupt(done, total):
        if done == 2:
            raise KeyboardInterrupt

    def save():
        with pytest.raises(KeyboardInterrupt):
            save_film(plan, tmp_path / f"film{suffix}", fps=2, **TINY, progress=interrupt)

    if made(lambda: check_film(tmp_path / f"film{suffix}") or True):
        save()
        assert all(process.poll() is not None for process in started)
        assert bool(started) == (suffix == ".mp4")  # the search for ffmpeg starts a process too
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [
        (f"film{suffix}", "what was there before")
    ]


def test_an_abandoned_frame_generator_frees_its_context(plan):
    def first():
        shown = frames(plan, fps=2, **TINY)
        image = next(shown)
        shown.close()
        return image

    image = made(first)
    gc.collect()
    assert image is None or image.shape == (64, 96, 3)


@pytest.mark.parametrize(
    ("name", "message"),
    [("a.mp3", "Did you mean '.mp4'"), ("a.mov", "Known: .gif, .mp4, .webp"), ("a", "suffix of a film")],
)
def test_an_unknown_suffix_is_refused_with_those_that_exist(plan, tmp_path, name, message):
    for call in (lambda: check_film(tmp_path / name), lambda: save_film(plan, tmp_path / name)):
        with pytest.raises(UnknownNameError) as caught:
            call()
        assert message in str(caught.value)


def test_without_ffmpeg_the_extra_is_named_before_anything_is_made(plan, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(ffmpeg.shutil, "which", lambda name: None)
    with pytest.raises(MmpError, match=r"pip install 'mmp-env\[film\]'"):
        check_film(tmp_path / "a.mp4")
    made(lambda: check_film(tmp_path / "a.gif"))
    monkeypatch.setattr(ffmpeg.shutil, "which", lambda name: "/usr/bin/the-system-s")
    assert ffmpeg.find_ffmpeg() == "/usr/bin/the-system-s"


def test_errors_of_ffmpeg_are_passed_on_and_nothing_is_left(plan, tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'no such encoder' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(ffmpeg, "find_ffmpeg", lambda: str(program))
    with pytest.raises(MmpError) as caught:
        save_film(plan, tmp_path / "a.mp4", fps=2, **TINY)
    assert re.search(f"no such encoder|{NONE_HERE}", str(caught.value))
    assert os.listdir(tmp_path) == ["ffmpeg"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fps": 0}, "fps is 0; it must be more than 0 and at most 60"),
        ({"fps": float("nan")}, "fps is nan"),
        ({"fps": 61}, "fps is 61; it must be more than 0 and at most 60"),
        ({"width": 97}, "width is 97; an MP4 film has an even number"),
        ({"height": 5000}, "height is 5000"),
    ],
)
def test_impossible_numbers_are_one_sentence(plan, tmp_path, options, message):
    with pytest.raises(MmpError, match=f"{message}|{NONE_HERE}"):
        save_film(plan, tmp_path / "a.mp4", **TINY | options)
    assert list(tmp_path.iterdir()) == []
