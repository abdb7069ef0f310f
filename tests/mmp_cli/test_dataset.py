"""`mmp dataset`: expert episodes that the environment repeats, counted honestly, whole, and continued."""

import errno
import fcntl
import gc
import json
import os
from pathlib import Path
from unittest import mock

import mujoco
import numpy as np
import pytest

from mmp_cli.datasets.folder import DatasetFolder, exclusive
from mmp_cli.main import main
from mmp_env.errors import MmpError
from mmp_env.gym import registration
from mmp_env.gym.control import CONTROL_MODES
from mmp_env.gym.env import MultiArmCellEnv


def index_of(folder):
    return json.loads((folder / "dataset.json").read_text())


@pytest.mark.parametrize("mode", CONTROL_MODES)
def test_the_actions_of_an_episode_give_its_observations_again(mode, tmp_path, capsys):
    words = ["dataset", "MultiArmCell-2", "--count", "1", "--seed", "5", "--out", str(tmp_path / "a"), "--json"]
    assert main([*words, "--control-mode", mode]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["instances"], said["episodes"], said["left_out"]) == (1, 1, {})
    episode = np.load(tmp_path / "a" / "episodes" / "00000.npz")
    steps = said["steps"]
    assert episode["actions"].shape == (steps, 12)
    assert np.abs(episode["actions"]).max() <= 1.0
    assert len(episode["observations.joint_positions"]) == steps + 1
    assert episode["terminations"].tolist() == [False] * (steps - 1) + [True]
    assert not episode["truncations"].any()
    env = MultiArmCellEnv(cell="ring-2", control_mode=mode)
    env.reset(seed=5)
    start = {name: np.array(q) for name, q in env.problem.start.items()}
    goal = np.split(episode["observations.goal_positions"][0], 2)
    observation, _ = env.reset(options={"start": start, "goal": dict(zip(env.cell.arm_names, goal, strict=True))})
    for k in range(steps):
        for name, value in observation.items():
            np.testing.assert_array_equal(value, episode[f"observations.{name}"][k])
        observation, reward, terminated, _, info = env.step(episode["actions"][k])
        assert reward == episode["rewards"][k]
        assert terminated == episode["terminations"][k]
    assert info["is_success"]


def test_a_dataset_is_continued_and_the_same_seed_gives_the_same_one(tmp_path):
    words = ["dataset", "MultiArmCell-2", "--out"]
    assert main([*words, str(tmp_path / "a"), "--count", "1"]) == 0
    before = (tmp_path / "a" / "episodes" / "00000.npz").stat().st_mtime_ns
    assert main([*words, str(tmp_path / "a"), "--count", "3"]) == 0
    assert (tmp_path / "a" / "episodes" / "00000.npz").stat().st_mtime_ns == before
    assert main([*words, str(tmp_path / "b"), "--count", "3"]) == 0
    assert index_of(tmp_path / "a") == index_of(tmp_path / "b")
    for k in range(3):
        one, other = (np.load(tmp_path / name / "episodes" / f"{k:05}.npz") for name in ("a", "b"))
        assert one.files == other.files
        for name in one.files:
            np.testing.assert_array_equal(one[name], other[name])


def test_a_second_process_in_the_same_folder_is_refused(tmp_path, capsys):
    words = ["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]
    (tmp_path / "a").mkdir()
    handle = os.open(tmp_path / "a", os.O_RDONLY)
    fcntl.flock(handle, fcntl.LOCK_EX)
    assert main(words) == 2
    assert "in use by another mmp dataset" in capsys.readouterr().err
    assert not list((tmp_path / "a").iterdir())
    os.close(handle)
    assert main(words) == 0


def test_a_refused_process_does_not_remove_the_folder_that_another_one_has_just_made(tmp_path):
    path, handles = tmp_path / "a", []

    def other_first(folder, **_):
        """Lets another process make and lock the folder after this one has seen that it is missing."""
        os.mkdir(folder)
        handles.append(os.open(folder, os.O_RDONLY))
        fcntl.flock(handles[0], fcntl.LOCK_EX)

    with (
        mock.patch.object(Path, "mkdir", other_first),
        pytest.raises(MmpError, match="in use by another mmp dataset"),
        exclusive(path),
    ):
        pass
    os.close(handles[0])
    assert path.is_dir()


def test_a_refusal_leaves_no_empty_folder(tmp_path):
    with mock.patch.object(DatasetFolder, "add", side_effect=MmpError("no")):
        assert main(["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a" / "b")]) == 2
    assert not (tmp_path / "a").exists()


def test_instances_without_an_episode_are_counted(tmp_path, capsys):
    words = ["dataset", "MultiArmCell-8", "--planner", "cbs", "--time-limit", "0.001", "--count", "2", "--json"]
    assert main([*words, "--out", str(tmp_path / "a")]) == 1
    said = json.loads(capsys.readouterr().out)
    assert (said["instances"], said["episodes"], said["left_out"]) == (2, 0, {"no plan: timeout": 2})
    assert [line["outcome"] for line in index_of(tmp_path / "a")["instances"]] == ["no plan: timeout"] * 2


def test_bad_input_is_one_sentence(tmp_path, capsys):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("x")
    (tmp_path / "file").write_text("x")
    assert main(["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]) == 0
    for words, said in (
        (["MultiArmCell-3", "--out", str(tmp_path / "b")], "MultiArmCell-3"),
        (["MultiArmCell-2", "--out", str(tmp_path / "b"), "--planner", "aut"], "auto"),
        (["MultiArmCell-2", "--out", str(tmp_path / "b"), "--control-mode", "torque"], "position"),
        (["MultiArmCell-2", "--out", str(tmp_path / "other")], "has other files"),
        (["MultiArmCell-2", "--out", str(tmp_path / "file")], "is not a folder"),
        (["MultiArmCell-2", "--out", str(tmp_path / "a"), "--planner", "ecbs"], "planner 'auto', not 'ecbs'"),
    ):
        capsys.readouterr()
        assert main(["dataset", *words]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert "Traceback" not in error
    assert not (tmp_path / "b").exists()


def test_a_changed_cell_is_named_unless_another_setting_explains_it(tmp_path):
    index = {"schema": "mmp-dataset/1", "settings": {"cell": "402a66cc", "robot": "ur5e"}, "instances": []}
    (tmp_path / "dataset.json").write_text(json.dumps(index))
    with pytest.raises(MmpError, match="another cell: the cell, its robots or the instances are not what they were"):
        DatasetFolder(tmp_path, {"cell": "33ba48d6", "robot": "ur5e"})
    with pytest.raises(MmpError, match="has a dataset with robot 'ur5e', not 'panda'"):
        DatasetFolder(tmp_path, {"cell": "33ba48d6", "robot": "panda"})


BROKEN = {
    "schema": (lambda d: d | {"schema": "other/1"}, "schema is 'other/1'; it must be 'mmp-dataset/1'"),
    "settings": (lambda d: d | {"settings": []}, "settings"),
    "instances": (lambda d: d | {"instances": 3}, "instances"),
    "instance": (lambda d: d | {"instances": [3]}, r"instances\[0\]"),
    "outcome": (lambda d: d | {"instances": [{"name": "a", "seed": 0}]}, r"instances\[0\]"),
    "steps": (lambda d: d | {"instances": [d["instances"][0] | {"steps": "a"}]}, r"instances\[0\]\.steps"),
    "twice": (lambda d: d | {"instances": 2 * d["instances"]}, "no other instance"),
    "no steps": (lambda d: d | {"instances": [d["instances"][0] | {"steps": 0}]}, "steps is 0; it must be"),
    "outside": (lambda d: d | {"instances": [d["instances"][0] | {"file": "../a.npz"}]}, "'episodes/00000.npz'"),
}


@pytest.mark.parametrize(("change", "said"), BROKEN.values(), ids=BROKEN)
def test_what_is_wrong_in_an_index_is_named(change, said, tmp_path):
    (tmp_path / "episodes").mkdir()
    (tmp_path / "episodes" / "00000.npz").touch()
    line = {"name": "a", "seed": 0, "outcome": "success", "file": "episodes/00000.npz", "steps": 1}
    index = {"schema": "mmp-dataset/1", "settings": {}, "instances": [line]}
    (tmp_path / "dataset.json").write_text(json.dumps(index))
    assert DatasetFolder(tmp_path, {}).lines == [line]
    (tmp_path / "dataset.json").write_text(json.dumps(change(index)))
    with pytest.raises(MmpError, match=said):
        DatasetFolder(tmp_path, {})


def test_an_episode_that_is_missing_is_named(tmp_path):
    words = ["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]
    assert main(words) == 0
    (tmp_path / "a" / "episodes" / "00000.npz").unlink()
    with pytest.raises(MmpError, match=r"00000\.npz is missing"):
        DatasetFolder(tmp_path / "a", {})


def test_more_instances_than_a_dataset_may_have_are_refused(tmp_path, capsys):
    assert main(["dataset", "MultiArmCell-2", "--count", "250001", "--out", str(tmp_path / "a")]) == 2
    assert "--count 250001 is too large; a dataset has at most 250000 instances" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"name": "MultiArmCell-2/77"},
            "instances[0] is MultiArmCell-2/77 with seed 0, which MultiArmCell-2 does not",
        ),
        ({"seed": 4}, "instances[0] is MultiArmCell-2/0 with seed 4, which MultiArmCell-2 does not"),
        ({"outcome": "no plan: timeout"}, "instances[0].outcome is 'no plan: timeout'; it must be 'success'"),
    ],
)
def test_an_index_with_an_instance_that_the_source_does_not_have_is_refused(changes, words, tmp_path, capsys):
    command = ["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]
    assert main(command) == 0
    index = tmp_path / "a" / "dataset.json"
    data = json.loads(index.read_text())
    data["instances"][0] |= changes
    index.write_text(json.dumps(data))
    capsys.readouterr()
    assert main(command) == 2
    assert words in capsys.readouterr().err
    assert json.loads(index.read_text()) == data


def test_a_dataset_with_a_wrong_episode_is_refused_before_anything_is_planned(tmp_path, capsys):
    words = ["dataset", "MultiArmCell-2", "--out", str(tmp_path / "a"), "--count"]
    assert main([*words, "1"]) == 0
    file = tmp_path / "a" / "episodes" / "00000.npz"
    with np.load(file) as arrays:
        np.savez(file, **dict(arrays) | {"actions": arrays["actions"] * np.float32(np.nan)})
    index, content = index_of(tmp_path / "a"), file.read_bytes()
    capsys.readouterr()
    assert main([*words, "2"]) == 2
    assert "00000.npz: array 'actions' has nan at [0, 0]" in capsys.readouterr().err
    assert sorted(path.name for path in (tmp_path / "a").rglob("*")) == ["00000.npz", "dataset.json", "episodes"]
    assert (index_of(tmp_path / "a"), file.read_bytes()) == (index, content)


def refuse(*_, **__):
    raise OSError(errno.EIO, "Input/output error")


@pytest.mark.parametrize("refused", ["write_text", "mkdir"])
def test_a_dataset_whose_first_episode_was_not_written_is_continued(refused, tmp_path, monkeypatch, capsys):
    words = ["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / ".mmp-1.tmp").write_text("{")  # of a process that was killed
    with monkeypatch.context() as patch:
        patch.setattr(Path, refused, refuse)
        assert main(words) == 2
    assert "Input/output error" in capsys.readouterr().err
    assert main(words) == 0
    assert len(index_of(tmp_path / "a")["instances"]) == 1


def test_too_little_memory_for_an_episode_is_a_sentence(tmp_path, monkeypatch, capsys):
    def no_memory(*_, **__):
        raise MemoryError

    words = ["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]
    for target in ("zlib.compressobj", "zipfile._ZipWriteFile.write"):
        with monkeypatch.context() as patch:
            patch.setattr(target, no_memory)
            code = main(words)
            gc.collect()
        error = capsys.readouterr().err
        assert code == 0 or "memory" in error
        assert "Traceback" not in error


@pytest.mark.parametrize("compiled", [0, 1])
def test_no_memory_for_an_environment_ends_the_command(compiled, tmp_path, monkeypatch, capsys):
    calls, compile_ = [], mujoco.MjSpec.compile

    def no_memory(spec):
        calls.append(spec)
        if len(calls) > compiled:
            raise ValueError("Error: Could not allocate memory for texture")
        return compile_(spec)

    monkeypatch.setattr(mujoco.MjSpec, "compile", no_memory)
    assert main(["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]) == 2
    assert "memory" in capsys.readouterr().err
    assert len(calls) == compiled + 1, "one environment before anything is planned, and one for the instance"
    assert not (tmp_path / "a" / "dataset.json").exists(), "an instance whose episode got no memory is tried again"


def test_a_folder_whose_name_is_too_long_is_a_sentence(capsys):
    assert main(["dataset", "MultiArmCell-2", "--count", "1", "--out", "a" * 300]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_broken_index_is_refused(tmp_path):
    (tmp_path / "dataset.json").write_text("[1")
    with pytest.raises(MmpError, match="is not the index of a dataset"):
        DatasetFolder(tmp_path, {})


def test_action_towards_reaches_a_configuration_and_refuses_others():
    env = MultiArmCellEnv(cell="ring-2", control_mode="velocity")
    env.reset(seed=0)
    q = np.concatenate([env.problem.start[name] for name in env.cell.arm_names])
    np.testing.assert_allclose(env.action_towards(q), 0.0, atol=1e-6)
    assert env.action_towards(q + 1.0).tolist() == [1.0] * 12
    with pytest.raises(MmpError, match="12 finite numbers"):
        env.action_towards(q[:3])


def test_a_dataset_without_a_time_limit_is_continued(tmp_path, capsys):
    words = ["dataset", "MultiArmCell-2", "--planner", "prioritized", "--out", str(tmp_path / "a"), "--count"]
    assert main([*words, "1", "--time-limit", "inf"]) == 0
    assert main([*words, "2", "--time-limit", "inf"]) == 0
    assert index_of(tmp_path / "a")["settings"]["time_limit"] is None
    assert len(index_of(tmp_path / "a")["instances"]) == 2
    assert main([*words, "2", "--time-limit", "5"]) == 2
    assert "has a dataset with time_limit None, not 5.0" in capsys.readouterr().err


def test_an_episode_that_is_longer_than_the_environment_allows_is_named(tmp_path, monkeypatch, capsys):
    words = ["dataset", "MultiArmCell-2", "--count", "1", "--out", str(tmp_path / "a")]
    assert main(words) == 0
    assert "max_episode_steps" not in capsys.readouterr().err
    steps = index_of(tmp_path / "a")["instances"][0]["steps"]
    monkeypatch.setattr(registration, "MAX_EPISODE_STEPS", steps - 1)
    assert main(words) == 0
    error = capsys.readouterr().err
    assert f"the longest episode has {steps} steps" in error
    assert f"give it max_episode_steps={steps}" in error


def test_an_index_that_is_nested_too_deeply_is_a_sentence(tmp_path):
    (tmp_path / "dataset.json").write_text("[" * 100_000)
    with pytest.raises(MmpError, match="nested too deeply"):
        DatasetFolder(tmp_path, {})
