"""`mmp dataset --format minari`: what Minari loads is what the files have."""

import errno
import json
import os
from unittest import mock

import numpy as np
import pytest
from support import bad_files

from mmp_cli.main import main
from mmp_env import find_cell
from mmp_env.files.cell_file import cell_to_dict


def test_minari_loads_the_dataset_and_makes_its_environment(tmp_path, capsys):
    minari = pytest.importorskip("minari")
    words = ["dataset", "MultiArmCell-2", "--count", "2", "--out", str(tmp_path / "a"), "--format", "minari"]
    assert main([*words, "--control-mode", "delta", "--task", "parallel", "--robot", "panda"]) == 0
    (name,) = (tmp_path / "a").glob("Multi*")
    with mock.patch.dict(os.environ, MINARI_DATASETS_PATH=str(tmp_path / "a")):
        found = minari.load_dataset(f"{name.name}/expert-v0")
    env = found.recover_environment()
    asked = {"cell": "ring-2", "control_mode": "delta", "task": "parallel", "robot": "panda"}
    assert env.spec.kwargs == asked
    assert [arm.robot.name for arm in env.unwrapped.cell.arms] == ["panda"] * 2
    assert (found.observation_space, found.action_space) == (env.observation_space, env.action_space)
    assert found.total_episodes == 2
    for k, episode in enumerate(found):
        kept = np.load(tmp_path / "a" / "episodes" / f"{k:05}.npz")
        steps = len(kept["actions"])
        assert episode.observations.keys() == env.observation_space.keys()
        lengths = {len(rows) for rows in episode.observations.values()}
        ended = {len(rows) for rows in (episode.actions, episode.rewards, episode.terminations, episode.truncations)}
        assert (lengths, ended) == ({steps + 1}, {steps})
        assert episode.actions.dtype == env.action_space.dtype
        assert all(action in env.action_space for action in episode.actions)
        for t in range(steps + 1):
            observation = {part: rows[t] for part, rows in episode.observations.items()}
            assert observation in env.observation_space
        for part, rows in episode.observations.items():
            assert rows.dtype == env.observation_space[part].dtype
            np.testing.assert_array_equal(rows, kept[f"observations.{part}"])
        for part in ("actions", "rewards", "terminations", "truncations"):
            np.testing.assert_array_equal(getattr(episode, part), kept[part])
        infos = {name.removeprefix("infos."): kept[name] for name in kept.files if name.startswith("infos.")}
        assert episode.infos.keys() == infos.keys() == {"is_success", "distance_rad", "contacts"}
        for part, rows in infos.items():
            assert len(rows) == steps
            np.testing.assert_array_equal(episode.infos[part], rows)
    env.reset(seed=0)
    env.step(found[0].actions[0])


def test_a_minari_dataset_of_a_file_has_no_environment(tmp_path, capsys):
    minari = pytest.importorskip("minari")
    cell_file = tmp_path / "cell.json"
    cell_file.write_text(json.dumps(cell_to_dict(find_cell("ring-2"))))
    words = ["dataset", str(cell_file), "--count", "1", "--out", str(tmp_path / "a"), "--format", "minari"]
    assert main(words) == 0
    with mock.patch.dict(os.environ, MINARI_DATASETS_PATH=str(tmp_path / "a")):
        (name,) = minari.list_local_datasets()
        assert minari.load_dataset(name).env_spec is None


def test_a_minari_dataset_is_written_though_the_first_instance_is_invalid(tmp_path, capsys):
    pytest.importorskip("minari")
    instances = bad_files.good_instances()
    good = instances["instances"][0]
    bad = good | {"name": "bad", "start": good["start"] | {"left": [99.0] * 6}}
    file = tmp_path / "instances.json"
    file.write_text(json.dumps(instances | {"instances": [bad, good]}))
    words = ["dataset", str(file), "--count", "2", "--planner", "prioritized", "--format", "minari", "--json"]
    assert main([*words, "--out", str(tmp_path / "a")]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["episodes"], said["minari"]) == (1, "pair/expert-v0")


def test_a_minari_dataset_that_lacks_new_episodes_is_named_and_made_again(tmp_path, capsys):
    minari = pytest.importorskip("minari")
    words = ["dataset", "MultiArmCell-2", "--out", str(tmp_path / "a")]
    assert main([*words, "--count", "1", "--format", "minari"]) == 0
    assert main([*words, "--count", "2"]) == 0
    assert "lacks the new episodes" in capsys.readouterr().err
    with mock.patch.dict(os.environ, MINARI_DATASETS_PATH=str(tmp_path / "a")):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "rename", mock.Mock(side_effect=OSError(errno.EIO, "Input/output error")))
            assert main([*words, "--count", "2", "--format", "minari"]) == 2
        assert minari.load_dataset("MultiArmCell-2/expert-v0").total_episodes == 1
        assert main([*words, "--count", "2", "--format", "minari"]) == 0
        assert minari.load_dataset("MultiArmCell-2/expert-v0").total_episodes == 2
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["MultiArmCell-2", "dataset.json", "episodes"]
