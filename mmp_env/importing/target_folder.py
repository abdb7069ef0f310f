"""The folder that an import writes: refused before the import where it holds or hides what the import did not make."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_folder, real_path, refusal


@dataclass(frozen=True, kw_only=True)
class Imported:
    """Result of an import: its folder, whether it came from the cache, and whether it replaced an earlier import."""

    folder: Path
    from_cache: bool
    replaced: bool


@dataclass(frozen=True, kw_only=True)
class TargetFolder:
    """Folder `out`/`name` of a robot or tool (`kind`), whose `description` is robot.json or tool.json."""

    out: Path
    name: str
    kind: str
    description: str

    def checked(self, inputs: Sequence[str | Path]) -> Path:
        """Returns the path without links, after a check that an import may write there.

        Args:
            inputs: Files and folders that the import reads.

        Raises:
            MmpError: if `out` is no folder, if the target is a link or something else, or if it holds an input or a
                file that no import wrote.
        """
        self._refuse_out()
        given = self.out / self.name
        target = real_path(given)
        if given.is_symlink():
            where = os.readlink(given)
            raise MmpError(f"{given} is a symbolic link to {where}; give another --name or --out, or remove the link")
        for path in inputs:
            real = real_path(path)
            if target == real or target in real.parents:
                raise MmpError(f"{path} is an input and lies in {target}, which the import writes; give another --out")
        if not exists(target):
            return target
        if not (is_folder(target) and exists(target / self.description)):
            raise MmpError(f"{target} is there already and is no {self.kind}; give another --name or --out")
        for path in self._foreign(target):
            raise MmpError(
                f"{target} holds {path.relative_to(target)}, which no import wrote and which would be lost;"
                " move it, or give another --name or --out"
            )
        return target

    def _refuse_out(self) -> None:
        for folder in (self.out, *self.out.parents):
            if exists(folder):
                if not is_folder(folder):
                    raise MmpError(f"--out {self.out} must be a folder, and {folder} is a file")
                return

    def _foreign(self, target: Path) -> Iterator[Path]:
        """Yields the paths in the folder that no import of this name writes, in the order of their names."""
        parts = (target, *(target / state for state in self._states(target)))
        files = (self.description, "spheres.json", "hulls.json", f"{self.name}.xml")
        written = {part / file for part in parts for file in files}
        for path in _entries(target):
            is_own = path.is_file() if path in written else path in parts and path.is_dir()
            if path.is_symlink() or not is_own:
                yield path

    def _states(self, target: Path) -> list[str]:
        try:
            states = json.loads((target / self.description).read_text(encoding="utf-8")).get("states", [])
        except (OSError, ValueError, AttributeError):
            return []
        return [state for state in states if isinstance(state, str)] if isinstance(states, list) else []


def _entries(folder: Path) -> Iterator[Path]:
    """Yields all files and folders in a folder, sorted, without following links. Raises `MmpError`."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        raise refusal(folder, "read", error) from None
    for entry in entries:
        yield folder / entry.name
        if entry.is_dir(follow_symlinks=False):
            yield from _entries(folder / entry.name)
