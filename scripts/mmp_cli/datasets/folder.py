"""The folder of a dataset: `dataset.json` says what was asked and what came of it, `episodes/` has the arrays."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from mmp_cli.benchmark.sources import Instances
from mmp_cli.datasets.episode_file import Rows, read_episode
from mmp_cli.datasets.expert import Episode
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_file
from mmp_env.files.reading import Location, NotJsonError, decode_file, parse_json
from mmp_env.files.temporaries import PREFIX as TEMPORARY
from mmp_env.files.writing import json_text, whole_file, write_text

SCHEMA = "mmp-dataset/1"
INDEX, EPISODES = "dataset.json", "episodes"
SUCCESS = "success"
"""Outcome of an instance whose episode is in the dataset."""


class _Instance(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    name: str
    seed: int
    outcome: str
    file: str | None = None
    steps: int = 0


class _Settings(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    source: Any = None
    cell: Any = None
    seed: Any = None
    planner: Any = None
    time_limit: Any = None
    control_mode: Any = None
    task: Any = None
    robot: Any = None
    margin: Any = None
    version: Any = None


class _Index(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    settings: _Settings
    instances: list[_Instance]


@contextlib.contextmanager
def exclusive(path: Path) -> Iterator[None]:
    """Makes the folder of a dataset and keeps other processes out. A new folder that stays empty is removed again.

    Raises `MmpError` if another process has the folder, or if it cannot be made.
    """
    missing = [folder for folder in (path, *path.parents) if not exists(folder)]
    try:
        path.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except (FileExistsError, NotADirectoryError):
        raise MmpError(f"--out {path} is not a folder") from None
    except OSError as error:
        raise MmpError(f"--out {path} cannot be written: {error.strerror}") from None
    try:
        _lock(handle, path)
        try:
            yield
        finally:  # only the process that has the folder removes it, while it has it
            with contextlib.suppress(OSError):  # not empty
                for folder in missing:
                    folder.rmdir()
    finally:
        os.close(handle)


def _lock(handle: int, path: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise MmpError(f"--out {path} is in use by another mmp dataset; wait for it, or give another folder") from None
    except OSError:
        pass  # some network file systems cannot lock a folder


class DatasetFolder:
    """A dataset that grows by one instance after the other, each written whole.

    Args:
        path: the folder: an empty one, or one of the same settings. A writer has it `exclusive`.
        settings: what determines the episodes.

    Raises:
        MmpError: for a folder with other settings or other files, or whose index is wrong.
    """

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self.path, self.settings = path, settings
        self.lines: list[dict[str, Any]] = []
        if exists(path / INDEX):
            self._read()
        elif exists(path) and any(not entry.name.startswith(TEMPORARY) for entry in path.iterdir()):
            raise MmpError(f"--out {path} has other files; give a new folder, or one that mmp dataset has begun")

    @property
    def done(self) -> set[str]:
        """Names of the instances that are done."""
        return {line["name"] for line in self.lines}

    @property
    def outcomes(self) -> Counter[str]:
        """Outcome -> number of instances."""
        return Counter(line["outcome"] for line in self.lines)

    def episodes(self, allowed: Mapping[str, Rows]) -> Iterator[dict[str, np.ndarray]]:
        """Yields the arrays of each episode, which hold what is allowed.

        Raises `MmpError` for another file, as `read_episode`.
        """
        for line in self.lines:
            if "file" in line:
                yield read_episode(self.path / line["file"], line["steps"], allowed)

    def check_instances(self, source: Instances) -> None:
        """Raises `MmpError` for an instance that the source does not have."""
        for k, line in enumerate(self.lines):
            if not source.has(line["name"], line["seed"]):
                place = Location(str(self.path / INDEX)) / "instances" / k
                raise MmpError(
                    f"{place} is {line['name']} with seed {line['seed']}, which {source.title} does not have"
                )

    def check_episodes(self, allowed: Mapping[str, Rows]) -> None:
        """Raises `MmpError` for an episode that cannot be read or holds something else than what is allowed."""
        for _ in self.episodes(allowed):
            pass

    @property
    def longest(self) -> int:
        """Number of steps of the longest episode; 0 if there is none."""
        return max((line.get("steps", 0) for line in self.lines), default=0)

    @property
    def files(self) -> list[Path]:
        """The files of all episodes, in their order."""
        return [self.path / line["file"] for line in self.lines if "file" in line]

    def add(self, name: str, seed: int, outcome: str, episode: Episode | None) -> None:
        """Adds an instance: its episode if it has one, then its line. Raises `MmpError` if it cannot be written."""
        line: dict[str, Any] = {"name": name, "seed": seed, "outcome": outcome}
        try:
            if not self.lines:
                self._write_index()  # before anything else, so that a folder that is not finished is known as a dataset
            (self.path / EPISODES).mkdir(exist_ok=True)
        except OSError as error:
            raise MmpError(f"--out {self.path} cannot be written: {error.strerror}") from None
        if episode is not None:
            line |= {"file": _episode_file(len(self.files)), "steps": episode.steps}
            with whole_file(self.path / line["file"]) as temporary, temporary.open("wb") as file:
                arrays: dict[str, Any] = episode.arrays()
                np.savez(file, **arrays)  # compressing needs memory, and an archive without it cannot be closed
        self.lines.append(line)
        self._write_index()

    def _write_index(self) -> None:
        write_text(self.path / INDEX, json_text({"schema": SCHEMA, "settings": self.settings, "instances": self.lines}))

    def _read(self) -> None:
        place = Location(str(self.path / INDEX))
        try:
            data = parse_json((self.path / INDEX).read_text(encoding="utf-8"), place)
        except (OSError, UnicodeDecodeError, NotJsonError):
            raise MmpError(f"{place} is not the index of a dataset") from None
        place, index = decode_file(data, SCHEMA, _Index, place)
        for key in sorted(self.settings, key=lambda key: key == "cell"):  # another robot also makes another cell
            value, there = self.settings[key], getattr(index.settings, key)
            if json.dumps(there, sort_keys=True) != json.dumps(value, sort_keys=True):  # to Python, False == 0
                if key == "cell":
                    raise MmpError(
                        f"--out {self.path} has a dataset of another cell: the cell, its robots or the instances are"
                        " not what they were; give a new folder"
                    )
                raise MmpError(f"--out {self.path} has a dataset with {key} {there!r}, not {value!r}")
        names = Counter(line.name for line in index.instances)
        for k, line in enumerate(index.instances):
            where = place / "instances" / k
            if names[line.name] > 1:
                raise (where / "name").wrong(line.name, "a name that no other instance has")
            self.lines.append({"name": line.name, "seed": line.seed, "outcome": line.outcome})
            if line.outcome == SUCCESS:
                file = _episode_file(len(self.files))
                if line.file != file:
                    raise (where / "file").wrong(line.file, f"'{file}'")
                if not is_file(self.path / file):
                    raise MmpError(f"{self.path / file} is missing; put it back, or begin another folder")
                if line.steps < 1:
                    raise (where / "steps").wrong(line.steps, "a number of steps from 1")
                self.lines[-1] |= {"file": file, "steps": line.steps}
            elif line.file is not None:
                raise (where / "outcome").wrong(line.outcome, f"'{SUCCESS}', because the instance has a file")


def _episode_file(number: int) -> str:
    return f"{EPISODES}/{number:05}.npz"
