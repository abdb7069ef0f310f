"""A dataset in Minari's format, which is beside the episodes in the folder of the dataset."""

from __future__ import annotations

import os
import shutil
import warnings
from unittest import mock

import numpy as np

from mmp_cli.datasets.folder import DatasetFolder
from mmp_env.errors import MmpError
from mmp_env.gym.env import MultiArmCellEnv
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


def write(folder: DatasetFolder, name: str, env: MultiArmCellEnv) -> str:
    """Writes all episodes of a folder as one Minari dataset in it. Returns the dataset's id."""
    import minari
    from minari.data_collector import EpisodeBuffer

    buffers = []
    for number, arrays in enumerate(folder.episodes()):
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
    identity = f"{name}/{VERSION}"
    shutil.rmtree(folder.path / name / VERSION, ignore_errors=True)
    with (
        mock.patch.dict(os.environ, MINARI_DATASETS_PATH=str(folder.path.resolve())),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")  # it asks for an author and a link
        minari.create_dataset_from_buffers(
            identity,
            buffers,
            algorithm_name=folder.settings["planner"],
            action_space=env.action_space,
            observation_space=env.observation_space,
            description=f"Expert episodes of {name}, made by mmp dataset {__version__}",
            data_format="hdf5",
        )
    return identity


def _parts(arrays: dict[str, np.ndarray], kind: str) -> dict[str, np.ndarray]:
    return {name.partition(".")[2]: rows for name, rows in arrays.items() if name.startswith(f"{kind}.")}
