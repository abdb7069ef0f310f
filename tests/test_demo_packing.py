"""`scripts/demo_packing.py`: plans in a row, checked, saved and executed, and refused arguments."""

import json

import pytest
from support import bad_files, checkout_scripts

from mmp_env.check.episode import check_episode


def test_it_saves_an_episode_that_the_checker_proves_and_all_goals_are_reached(tmp_path):
    path = tmp_path / "episode.json"
    done = checkout_scripts.run("demo_packing.py", "--cell", "ring-2", "--task", "place", "--out", path)
    assert done.returncode == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()[:3]] == ["pick", "place", "home"]
    assert done.stdout.splitlines()[-1].endswith("all goals reached, no contact")
    assert "each plan from rest to rest" in done.stdout
    episode = json.loads(path.read_text())
    assert len(episode["plans"]) == 3
    assert check_episode(episode).valid


def test_plans_that_are_not_retimed_are_executed_with_a_warning():
    done = checkout_scripts.run("demo_packing.py", "--cell", "ring-2", "--task", "place", "--no-retime")
    assert done.returncode == 0, done.stderr
    assert "warning: the plans are not retimed" in done.stdout


def test_without_a_plan_in_time_nothing_is_written(tmp_path):
    path = tmp_path / "episode.json"
    done = checkout_scripts.run("demo_packing.py", "--cell", "ring-2", "--time-limit", "1e-6", "--out", path)
    assert done.returncode == 1
    assert "timeout" in done.stdout
    assert done.stderr == ""
    assert not path.exists()
    path.write_text("older")
    done = checkout_scripts.run("demo_packing.py", "--cell", "ring-2", "--time-limit", "1e-6", "--out", path)
    assert done.stderr == f"demo_packing.py: {path} is left as it was; this run wrote nothing to it\n"
    assert path.read_text() == "older"


@pytest.mark.parametrize("option", ["--out", "--video"])
def test_the_file_of_the_cell_is_not_overwritten(tmp_path, option):
    path = tmp_path / "pair.json"
    path.write_text(json.dumps(bad_files.good_cell()))
    done = checkout_scripts.run("demo_packing.py", "--cell", path, option, path)
    assert done.returncode == 2
    assert done.stderr == f"demo_packing.py: {option} would overwrite {path} itself; give another name\n"


def test_an_episode_may_have_the_name_of_a_cell():
    done = checkout_scripts.run("demo_packing.py", "--cell", "ring-2", "--time-limit", "1e-6", "--out", "ring-2")
    assert done.returncode == 1, done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--seed", "-1"], "'-1' is not a whole number"),
        (["--time-limit", "nan"], "'nan' is not a number of seconds above 0"),
        (["--planner", "aut"], "unknown planner 'aut'. Did you mean 'auto'"),
        (["--cell", "ring-3"], "unknown cell 'ring-3'"),
        (["--video", "film.mp5"], "unknown suffix of a film '.mp5'"),
        (["--out", "no/such/folder.json"], "no/such/folder.json cannot be written"),
    ],
)
def test_bad_usage_is_a_sentence_before_anything_is_drawn(words, message):
    done = checkout_scripts.run("demo_packing.py", *words)
    assert done.returncode == 2
    (sentence,) = done.stderr.splitlines()
    assert sentence.startswith("demo_packing.py: ")
    assert message in sentence
    assert done.stdout == ""
