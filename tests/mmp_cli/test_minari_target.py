"""`mmp dataset --format minari`: the name of its folder, what it refuses to replace, and disks that are full."""

import json
import os
import subprocess
import sys

import gymnasium
import pytest

from mmp_cli.datasets import minari_format
from mmp_cli.datasets.folder import DatasetFolder
from mmp_cli.datasets.minari_target import VERSION, check_target, minari_name
from mmp_cli.main import main
from mmp_env import find_cell
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_to_dict
from mmp_env.gym import registration

MOST_BYTES = 255
TITLES = [
    "episodes",
    "Episodes",
    "dataset.json",
    ".",
    "..",
    "a",
    "ä",
    "--",
    "a b",
    "漢" * 100,
    "\N{GRINNING FACE}",
    "x/y",
]
MMP = 'ulimit -f %d; exec "$0" -c \'from mmp_cli.main import main; raise SystemExit(main())\' "$@"'


@pytest.mark.parametrize("title", TITLES)
def test_the_name_of_every_cell_gives_a_name_that_minari_takes(title):
    minari = pytest.importorskip("minari")
    name = minari_name(title)
    assert minari.dataset.minari_dataset.parse_dataset_id(f"{name}/{VERSION}") == (name, "expert", 0)
    assert name.casefold() not in ("episodes", "dataset.json")
    assert len(name.encode()) <= MOST_BYTES
    assert not name.startswith("-")
    assert "/" not in name


def test_the_name_of_an_environment_stays():
    assert minari_name("MultiArmCell-4") == "MultiArmCell-4"
    assert minari_name("MultiArmCell-4 panda") == "MultiArmCell-4-panda"


def test_a_cell_that_is_called_episodes_keeps_its_episodes(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    (tmp_path / "cell.json").write_text(json.dumps(cell_to_dict(find_cell("ring-2")) | {"name": "episodes"}))
    words = ["dataset", str(tmp_path / "cell.json"), "--count", "1", "--format", "minari"]
    assert main([*words, "--out", str(tmp_path / "a")]) == 0
    assert (tmp_path / "a" / "episodes" / "00000.npz").is_file()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "a"))
    assert minari.load_dataset("cell-episodes/expert-v0").total_episodes == 1


@pytest.fixture
def command(tmp_path):
    """Writes a Minari dataset of one episode. Returns the command line that continues it."""
    pytest.importorskip("minari")
    words = ["dataset", "MultiArmCell-2", "--out", str(tmp_path / "a"), "--format", "minari", "--count"]
    assert main([*words, "1"]) == 0
    return words


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", ["notes.txt", "expert-v1/data/metadata.json", "expert-v0/data/notes.txt"])
def test_a_folder_with_a_file_of_the_user_is_refused_before_anything_is_planned(name, command, tmp_path, capsys):
    file = tmp_path / "a" / "MultiArmCell-2" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("mine")
    before = contents(tmp_path / "a")
    capsys.readouterr()
    assert main([*command, "2"]) == 2
    error = capsys.readouterr().err
    assert "which no mmp dataset wrote and which would be lost" in error
    assert error.count("\n") == 1
    assert contents(tmp_path / "a") == before


def test_a_minari_dataset_that_another_program_made_is_refused(command, tmp_path):
    target = tmp_path / "a" / "MultiArmCell-2"
    check_target(target)
    metadata = target / "expert-v0" / "data" / "metadata.json"
    metadata.write_text(json.dumps(json.loads(metadata.read_text()) | {"description": "mine"}))
    with pytest.raises(MmpError, match="holds expert-v0, which no mmp dataset wrote"):
        check_target(target)
    metadata.write_text("[" * 100_000)
    with pytest.raises(MmpError, match="holds expert-v0, which no mmp dataset wrote"):
        check_target(target)


@pytest.mark.parametrize("kind", ["link", "file", "empty"])
def test_what_is_no_folder_of_a_minari_dataset_is_refused(kind, command, tmp_path):
    target = tmp_path / "a" / "MultiArmCell-2"
    target.rename(tmp_path / "elsewhere")
    if kind == "link":
        target.symlink_to(tmp_path / "elsewhere")
    elif kind == "file":
        target.touch()
    else:
        target.mkdir()
        check_target(target)
        return
    with pytest.raises(MmpError, match="no folder that mmp dataset wrote"):
        check_target(target)


def test_a_file_that_appears_while_the_command_plans_is_kept(command, tmp_path, monkeypatch, capsys):
    add, file = DatasetFolder.add, tmp_path / "a" / "MultiArmCell-2" / "notes.txt"

    def add_and_write(self, *given):
        add(self, *given)
        file.write_text("mine")

    monkeypatch.setattr(DatasetFolder, "add", add_and_write)
    assert main([*command, "2"]) == 2
    assert "holds notes.txt" in capsys.readouterr().err
    assert file.read_text() == "mine"


@pytest.mark.parametrize("most_kb", [20, 200])
def test_a_minari_dataset_that_does_not_fit_is_one_sentence_and_leaves_nothing(most_kb, tmp_path):
    pytest.importorskip("minari")
    words = ["dataset", "MultiArmCell-2", "--count", "4", "--out", "a"]
    assert main([*words[:-1], str(tmp_path / "a")]) == 0
    line = ["bash", "-c", MMP % most_kb, sys.executable, *words, "--format", "minari"]
    ran = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert ran.stderr == "mmp: a/MultiArmCell-2 cannot be written: File too large\n"
    assert sorted(os.listdir(tmp_path / "a")) == ["dataset.json", "episodes"]


def test_a_crash_of_the_library_is_one_sentence_and_keeps_the_earlier_dataset(command, tmp_path, monkeypatch, capsys):
    before = contents(tmp_path / "a" / "MultiArmCell-2")
    monkeypatch.setattr(minari_format, "_write_into", lambda *_: os.kill(os.getpid(), 9))
    assert main([*command, "1"]) == 2
    error = capsys.readouterr().err
    assert "cannot be written: its process was killed by SIGKILL" in error
    assert error.count("\n") == 1
    assert contents(tmp_path / "a" / "MultiArmCell-2") == before
    assert sorted(os.listdir(tmp_path / "a")) == ["MultiArmCell-2", "dataset.json", "episodes"]


def test_a_failure_that_python_cannot_raise_is_reported(command, monkeypatch, capsys):
    class Lost:
        def __del__(self):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(minari_format, "_write_into", lambda *_: Lost() and None)
    assert main([*command, "1"]) == 2
    assert "cannot be written: No space left on device" in capsys.readouterr().err


def test_the_recovered_environment_allows_the_longest_episode(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    monkeypatch.setattr(registration, "MAX_EPISODE_STEPS", 10)
    words = ["dataset", "MultiArmCell-2", "--out", str(tmp_path / "a"), "--format", "minari", "--count", "2"]
    assert main(words) == 0
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "a"))
    found = minari.load_dataset("MultiArmCell-2/expert-v0")
    longest = max(len(episode) for episode in found)
    assert longest > registration.MAX_EPISODE_STEPS
    assert found.recover_environment().spec.max_episode_steps == longest
    assert gymnasium.spec("MultiArmCell-2").max_episode_steps == 200
