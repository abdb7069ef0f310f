"""The folder of a dataset: `dataset.json` says what was asked and what came of it, `episodes/` has the arrays."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from mmp_cli.datasets.expert import Episode
from mmp_env.errors import MmpError
from mmp_env.files.writing import json_text, whole_file, write_text

SCHEMA = "mmp-dataset/1"
INDEX, EPISODES = "dataset.json", "episodes"
SUCCESS = "success"
"""Outcome of an instance whose episode is in the dataset."""


class DatasetFolder:
    """A dataset that grows by one instance after the other, each written whole.

    Args:
        path: the folder: a new one, an empty one, or one of the same settings.
        settings: what determines the episodes.

    Raises:
        MmpError: for a folder with other settings or other files.
    """

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self.path, self.settings = path, settings
        self.lines: list[dict[str, Any]] = []
        if path.exists() and not path.is_dir():
            raise MmpError(f"--out {path} is not a folder")
        if (path / INDEX).exists():
            self._read()
        elif path.exists() and any(path.iterdir()):
            raise MmpError(f"--out {path} has other files; give a new folder, or one that mmp dataset has begun")

    @property
    def done(self) -> set[str]:
        """Names of the instances that are done."""
        return {line["name"] for line in self.lines}

    @property
    def outcomes(self) -> Counter[str]:
        """Outcome -> number of instances."""
        return Counter(line["outcome"] for line in self.lines)

    @property
    def files(self) -> list[Path]:
        """The files of all episodes, in their order."""
        return [self.path / line["file"] for line in self.lines if "file" in line]

    def add(self, name: str, seed: int, outcome: str, episode: Episode | None) -> None:
        """Adds an instance: its episode if it has one, then its line. Raises `MmpError` if it cannot be written."""
        line: dict[str, Any] = {"name": name, "seed": seed, "outcome": outcome}
        try:
            (self.path / EPISODES).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise MmpError(f"--out {self.path} cannot be written: {error.strerror}") from None
        if episode is not None:
            line |= {"file": f"{EPISODES}/{len(self.files):05}.npz", "steps": episode.steps}
            with whole_file(self.path / line["file"]) as temporary, temporary.open("wb") as file:
                arrays: dict[str, Any] = episode.arrays()
                np.savez_compressed(file, **arrays)
        self.lines.append(line)
        write_text(self.path / INDEX, json_text({"schema": SCHEMA, "settings": self.settings, "instances": self.lines}))

    def _read(self) -> None:
        try:
            found = json.loads((self.path / INDEX).read_text(encoding="utf-8"))
            kept, lines = found["settings"], found["instances"]
        except (OSError, ValueError, KeyError, TypeError):
            raise MmpError(f"{self.path / INDEX} is not the index of a dataset") from None
        for key, value in json.loads(json.dumps(self.settings)).items():
            if kept.get(key) != value:
                raise MmpError(f"--out {self.path} has a dataset with {key} {kept.get(key)!r}, not {value!r}")
        self.lines = lines
