"""The folder of a benchmark: results.jsonl, which is valid however a run ends, and the plans beside it."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import stat
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from msgspec import convert

from mmp_cli.benchmark.job import Key, Unit
from mmp_cli.benchmark.known_units import KnownUnits
from mmp_cli.benchmark.result_line import read_line
from mmp_cli.benchmark.settings import Settings, grown, load_settings, save_settings
from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_folder, real_path
from mmp_env.files.reading import Location, parse_json
from mmp_env.files.temporaries import PREFIX as TEMPORARY
from mmp_env.files.writing import file_name, write_text
from mmp_planners import Status

RESULTS, PLANS = "results.jsonl", "plans"
MOST_BYTES = 2**28
"""Largest size of results.jsonl: about 250,000 units."""


class ResultsFolder:
    """A folder that one run at a time writes to; a context manager.

    Entering it makes the folder, or continues an earlier run, perhaps with more sources, planners or instances. It cuts
    off a torn last line, and `lines` has the results so far of this run. Raises `MmpError` for a folder with other
    settings or other content, and for one that is in use.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any], keys: Collection[Key]) -> None:
        self.path, self.lines = path, dict[Key, dict[str, Any]]()
        self._settings, self._keys, self._file = settings, keys, -1

    @property
    def results(self) -> Path:
        return self.path / RESULTS

    def known(self) -> bool:
        """Returns whether an earlier run had all planners of these settings.

        Raises:
            MmpError: if the folder cannot be used, or has other settings.
        """
        target = real_path(self.path)
        standing = next(path for path in (target, *target.parents) if exists(path))
        if not (is_folder(standing) and os.access(standing, os.W_OK | os.X_OK)):
            what = "not to be written to" if is_folder(standing) else "not a folder"
            raise MmpError(f"{self.path} cannot be the folder of the results: {standing} is {what}")
        there = load_settings(self.path)
        if there is not None:
            return len(grown(there, self._settings, self.path)["planners"]) == len(there["planners"])
        if standing == target and (name := _foreign_file(target)):
            raise MmpError(
                f"{self.path} is no benchmark folder and is not empty: {name} is in it; give an empty or a new folder "
                "(--out)"
            )
        return False

    def __enter__(self) -> ResultsFolder:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            # Without blocking: if it is a pipe, nobody may ever write to it.
            self._file = os.open(self.results, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK, 0o666)
            if not stat.S_ISREG(os.fstat(self._file).st_mode):
                raise OSError(errno.EINVAL, f"{RESULTS} is not a regular file")
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._begin()
        except BlockingIOError:
            self._close()
            raise MmpError(f"{self.path} is in use by another mmp bench; wait for it, or give another folder") from None
        except OSError as error:
            self._close()
            raise MmpError(f"{self.path} cannot be written: {error.strerror}") from None
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def add(self, unit: Unit, line: dict[str, Any], plan: str | None) -> None:
        """Writes a result to the disk. Raises `MmpError` if it cannot be written."""
        if plan is not None:
            file = plan_path(unit)
            try:
                (self.path / file).parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise MmpError(f"{self.path / file} cannot be written: {error.strerror}") from None
            write_text(self.path / file, plan)
            line = line | {"plan": file.as_posix()}
        self._append(json.dumps(line).encode() + b"\n")
        self.lines[unit.key] = line

    def _append(self, row: bytes) -> None:
        """Writes a line with one call: afterwards it is complete, or it is a last line without its end."""
        end = os.lseek(self._file, 0, os.SEEK_END)
        try:
            if os.write(self._file, row) < len(row):
                raise OSError(0, "no room for a whole line")
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, end)
            raise MmpError(f"{self.results} cannot be written: {error.strerror}") from None

    def _begin(self) -> None:
        if os.fstat(self._file).st_size > MOST_BYTES:
            raise MmpError(f"{self.results} is larger than {MOST_BYTES / 2**20:g} MB; give another folder (--out)")
        content = _content(self._file)
        there = load_settings(self.path)
        if there is None:
            if content:
                raise MmpError(f"{self.results} exists without its settings.json; give another folder (--out)")
            save_settings(self._settings, self.path)
            return
        together = grown(there, self._settings, self.path)
        whole = content.rfind(b"\n") + 1
        self._read(content[:whole], KnownUnits(convert(together, Settings)))
        if together != there:
            save_settings(together, self.path)
        if whole < len(content):
            os.ftruncate(self._file, whole)
            os.fsync(self._file)

    def _read(self, content: bytes, units: KnownUnits) -> None:
        """Reads the results so far, which are of these units. Those of earlier, other starts are not in `lines`."""
        known = set[Key]()
        for number, row in enumerate(content.split(b"\n")[:-1], 1):
            place = Location(f"{self.results} line {number}")
            try:
                text = row.decode()
            except UnicodeDecodeError:
                raise MmpError(f"{place} is not text in UTF-8; repair it, or give another folder") from None
            if not text.strip():
                continue
            line = parse_json(text, place)
            key = _key(line)
            if key is None or (key not in self._keys and not units.has(key)):
                raise MmpError(f"{place} is not a result of this benchmark; remove it, or give another folder (--out)")
            if key in known:
                raise MmpError(f"{place} has the result of {' '.join(map(str, key))} for the second time; remove it")
            read_line(text, place)
            known.add(key)
            if key in self._keys:
                self.lines[key] = line

    def _close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def plan_path(unit: Unit) -> Path:
    """Returns the file of a unit's plan in the folder: plans/<instance>/<label>-<seed>.json."""
    parts = [file_name(part) for part in unit.instance.split("/")]
    return Path(PLANS, *parts, f"{file_name(unit.planner)}-{unit.seed}.json")


def _foreign_file(folder: Path) -> str | None:
    """Returns the name of an entry that no run of `mmp bench` has left before it wrote its settings, or None."""
    try:
        names = sorted(entry.name for entry in folder.iterdir())
    except OSError as error:
        raise MmpError(f"{folder} cannot be read: {error.strerror}") from None
    return next((name for name in names if name != RESULTS and not name.startswith(TEMPORARY)), None)


def _content(file: int) -> bytes:
    with open(file, "rb", closefd=False) as reader:
        reader.seek(0)
        return reader.read()


def _key(line: Any) -> Key | None:
    if not isinstance(line, dict) or line.get("status") not in list(Status):
        return None
    key = line.get("instance"), line.get("planner"), line.get("seed")
    return key if [type(part) for part in key] == [str, str, int] else None  # pyright: ignore[reportReturnType]
