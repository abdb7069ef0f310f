"""A dataset in Minari's format, which is beside the episodes in the folder of the dataset.

HDF5 may crash its process if a file cannot be written. So it writes to memory, in a child process.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec

from mmp_cli.child_call import call_in_child
from mmp_cli.datasets.episode_file import rows_of
from mmp_cli.datasets.folder import DatasetFolder
from mmp_cli.datasets.minari_target import MADE_BY, VERSION, check_target
from mmp_env.errors import NO_MEMORY, MmpError, in_words, is_out_of_memory
from mmp_env.files.paths import refusal
from mmp_env.files.temporaries import beside
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.importing.folder_writing import move_folder
from mmp_env.version import __version__


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
    target = folder.path / name

    def write_whole(root: str) -> None:
        lost: list[str] = []
        # Failures at the end of an object of HDF5, where Python cannot raise.
        sys.excepthook = lambda _, error, __: lost.append(_reason(error))
        sys.unraisablehook = lambda failure: lost.append(_reason(failure.exc_value))
        try:
            _write_into(root, folder, name, env, spec)
        except Exception as error:
            raise MmpError(_reason(error)) from None
        if lost:
            raise MmpError(lost[0])

    try:
        with beside(target) as new:
            new.mkdir()
            try:
                call_in_child(write_whole, str(new.resolve()), limit_s=math.inf)
            except MmpError as error:
                raise MmpError(f"{target} cannot be written: {error}") from None
            check_target(target)  # planning takes long enough for the folder to change
            move_folder(new / name, target)
    except OSError as error:
        raise refusal(target, "written", error) from None
    return f"{name}/{VERSION}"


def _write_into(root: str, folder: DatasetFolder, name: str, env: MultiArmCellEnv, spec: EnvSpec | None) -> None:
    """Writes the Minari dataset below the folder `root`. It changes settings of its process."""
    import h5py
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
    os.environ["MINARI_DATASETS_PATH"] = root
    h5py.File = functools.partial(_opened, h5py.File)
    warnings.simplefilter("ignore")  # it asks for an author and a link
    minari.create_dataset_from_buffers(
        f"{name}/{VERSION}",
        buffers,
        env=spec,
        algorithm_name=folder.settings["planner"],
        action_space=env.action_space,
        observation_space=env.observation_space,
        description=f"Expert episodes of {name}, {MADE_BY} {__version__}",
        data_format="hdf5",
    )


@contextlib.contextmanager
def _opened(of_h5py: Callable[..., Any], path: Path, mode: str, **options: Any) -> Iterator[Any]:
    """Yields a file of HDF5: a new one is in memory, and in the end is written to its path at once."""
    if mode == "r" or path.stat().st_size:
        with of_h5py(path, mode, **options) as file:
            yield file
        return
    with of_h5py(path, "w", driver="core", backing_store=False, **options) as file:
        yield file
        file.flush()
        path.write_bytes(file.id.get_file_image())


def _reason(error: BaseException | None) -> str:
    if error is None or is_out_of_memory(error):
        return NO_MEMORY
    return (error.strerror if isinstance(error, OSError) else None) or in_words(error)


def _parts(arrays: dict[str, np.ndarray], kind: str) -> dict[str, np.ndarray]:
    return {name.partition(".")[2]: rows for name, rows in arrays.items() if name.startswith(f"{kind}.")}
