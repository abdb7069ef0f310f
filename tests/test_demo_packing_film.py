"""`scripts/demo_packing.py --video`: motions that controllers accept, and a film of them."""

import functools
import importlib
import sys
from pathlib import Path

import pytest
from PIL import Image, ImageSequence
from support.picture_or_sentence import made

from mmp_env.files.episode_file import load_episode
from mmp_env.opengl import offscreen_backend
from mmp_env.view.films import ENCODERS

SCRIPTS = str(Path(__file__).parents[1] / "scripts")
SIZE, FPS = (64, 48), 0.5


@pytest.fixture
def demo(monkeypatch):
    """Returns the program with small films. Its folder is last on the path, so packages are the installed ones."""
    monkeypatch.setattr(sys, "path", [*sys.path, SCRIPTS])
    program = importlib.import_module("demo_packing")
    small = functools.partial(program.save_episode_film, width=SIZE[0], height=SIZE[1], fine=False)
    monkeypatch.setattr(program, "save_episode_film", small)
    monkeypatch.setattr(ENCODERS[".gif"], "usual_fps", FPS)
    return program


def test_all_plans_are_retimed_executed_and_filmed_in_a_row(demo, tmp_path, capsys):
    film, out = tmp_path / "packing.gif", tmp_path / "episode.json"
    words = ["--cell", "ring-2", "--task", "place", "--video", str(film), "--out", str(out)]
    code = demo.main(words)
    if made(offscreen_backend) is None:
        assert code == 2
        assert not out.exists()
        return
    output = capsys.readouterr().out
    assert code == 0, output
    assert "all goals reached, no contact" in output
    episode = load_episode(out)
    assert len(episode.plans) == 3
    assert all(plan.accelerations is not None for plan in episode.plans)
    with Image.open(film) as shown:
        assert shown.size == SIZE
        plays_s = sum(frame.info["duration"] for frame in ImageSequence.Iterator(shown)) / 1e3
    assert plays_s >= episode.makespan_s
