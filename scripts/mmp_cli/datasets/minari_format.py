"""A dataset in Minari's format, which is beside the episodes in the folder of the dataset."""

from __future__ import annotations

import os
import warnings
from unittest import mock

import numpy as np
from gymnasium.envs.registration import EnvSpec

from mmp_cli.datasets.episode_file import rows_of
from mmp_cli.datasets.folder import DatasetFolder
from mmp_env.errors import MmpError
from mmp_env.files.paths import refusal
from mmp_env.files.temporaries import beside
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.importing.folder_writing import move_folder
from mmp_env.version import __version__

VERSION = "expert-v0"


def require() -> None:
    """Raises `MmpError` if Minari is not installed."""
    try:
        import h5py
        import minari  # noqa: F401

        del h5py
    except ImportError as error:
        raise MmpError(f"--format minari needs the extra learning: pip install 'mmp-env[learning]' ({error})") from None


def write(folder: DatasetFolder, name: str, env: MultiArmCellEnv, spec: EnvSpec | None) -> str:
    """Writes all episodes of a folder as one Minari dataset in it, in place of an earlier one. Returns its id.

    Args:
        folder: the folder of the dataset.
        name: name of the dataset.
        env: the environment of the episodes.
        spec: what Gymnasium makes this environment with again, if it can.

    Raises:
        MmpError: for a file that holds another episode than one of the environment, and if it cannot be written.
    """
    import minari
    from minari.data_collector import EpisodeBuffer

    buffers = []
    for number, arrays in enumerate(folder.episodes(rows_of(env))):
        parts = {kind: _parts(arrays, kind) for kind in ("observations", "infos")}
        buffers.append(
            EpisodeBuffer(
                id=number,
                observations=parts["observations"],
                actions=list(arrays["actions"]),
                rewards=arrays["rewards"].tolist(),
                terminations=arrays["terminations"].tolist(),
                truncations=arrays["truncations"].tolist(),
                infos=parts["infos"],
            )
        )
    identity, target = f"{name}/{VERSION}", folder.path / name
    try:
        with (
            beside(target) as new,
            mock.patch.dict(os.environ, MINARI_DATASETS_PATH=str(new.resolve())),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")  # it asks for an author and a link
            new.mkdir()
            minari.create_dataset_from_buffers(
                identity,
                buffers,
                env=spec,
                algorithm_name=folder.settings["planner"],
                action_space=env.action_space,
                observation_space=env.observation_space,
                description=f"Expert episodes of {name}, made by mmp dataset {__version__}",
                data_format="hdf5",
            )
            move_folder(new / name, target)
    except OSError as error:
        raise refusal(target, "written", error) from None
    return identity


def _parts(arrays: dict[str, np.ndarray], kind: str) -> dict[str, np.ndarray]:
    return {name.partition(".")[2]: rows for name, rows in arrays.items() if name.startswith(f"{kind}.")}
