"""Runs a command with one call that fails."""

from __future__ import annotations

import os
import shutil
import signal
import struct
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from fuzz import samples

from faults.commands import Command
from mmp_env.files.temporaries import PREFIX as TEMPORARY

KINDS = ("error", "full", "readonly", "pipe", "stderr", "closed", "kill", "memory")
LONGEST_S = 600.0
ENDING_S = 10.0
"""Longest time until the helpers of a command are gone after they were killed [s]."""
LEAST_BYTES = 2**16
"""Smallest allocation that fails [bytes]: smaller ones are too many to fail each."""
HELPERS = ("cache", "tmp")
"""Folders of the run that may hold files of other programs."""
OWN_CACHE = "cache/mmp-env/"
"""Beginning of the names of files in the cache of `mmp`."""
AGAIN = "off"
"""Kind of the second run, in which nothing fails."""
CLOSING = ["sh", "-c", 'exec "$@" 2>&-', "sh"]
"""Command that runs another one with standard error closed."""
_SOURCES = sorted(Path(__file__).parent.glob("failing_*.cpp"))


@dataclass(frozen=True)
class Run:
    """One run of a command.

    Attributes:
        calls: how many calls counted.
        before: name -> content of the input files.
        there: name -> content of all files that were there when the run began, with the inputs and the cache of `mmp`.
        stale: names of the temporary files that were there when the run began.
    """

    command: Command
    code: int
    out: str
    err: str
    calls: int
    folder: Path
    before: dict[str, bytes]
    there: dict[str, bytes] = field(default_factory=dict)
    stale: frozenset[str] = frozenset()

    @property
    def was_killed(self) -> bool:
        """True if SIGKILL ended the process."""
        return self.code == -signal.SIGKILL

    @property
    def files(self) -> dict[str, Path]:
        """Name -> path of every file in the folder, temporary ones and those in caches left out."""
        return {name: path for name, path in self.kept.items() if not name.startswith(OWN_CACHE)}

    @property
    def kept(self) -> dict[str, Path]:
        """Name -> path of every file in the folder and in the cache of `mmp`, temporary ones left out."""
        return _own_files(self.folder)

    @property
    def contents(self) -> dict[str, bytes]:
        """Name -> content of the files that are `kept`."""
        return {name: path.read_bytes() for name, path in self.kept.items()}

    @property
    def temporary(self) -> list[str]:
        """Names of the temporary files that the run left, without those that it found."""
        return [name for name in _temporary(self.folder) if name not in self.stale]


class Kit:
    """Runs commands under the library of failing calls, which it compiles into the folder `home`."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.library = home / "failing_calls.so"
        compiler = os.environ.get("CXX") or shutil.which("g++") or "c++"
        subprocess.run(
            [compiler, "-std=c++20", "-shared", "-fPIC", "-O1", "-o", str(self.library), *map(str, _SOURCES), "-ldl"],
            check=True,
        )

    @contextmanager
    def folder(self, command: Command | None = None) -> Iterator[tuple[Path, dict[str, bytes]]]:
        """Yields a new folder with all input files, and these. The first line of the command has run there."""
        with tempfile.TemporaryDirectory(prefix="faults-", dir=self.home) as name:
            folder = Path(name, "work")
            for each in HELPERS:
                (folder / each).mkdir(parents=True)
            before = samples.write_all(folder)
            if command is not None and command.first:
                self.run(replace(command, line=command.first), folder, before, "off")
            yield folder, before

    def run(self, command: Command, folder: Path, before: dict[str, bytes], kind: str = "count", at: int = -1) -> Run:
        """Runs a command in a folder, and lets call number `at` fail as `kind` says; for `closed`, no call fails."""
        there = {name: path.read_bytes() for name, path in _own_files(folder).items()}
        beside, stale = folder.parent, frozenset(_temporary(folder))
        count = beside / "count"
        count.write_bytes(bytes(8))
        env = dict(
            os.environ,
            LD_PRELOAD=str(self.library),
            PYTHONFAULTHANDLER="1",
            FAULT_KIND="count" if kind == "closed" else kind,
            FAULT_AT=str(at),
            FAULT_ROOT=str(folder),
            FAULT_STDOUT=str(beside / "stdout"),
            FAULT_STDERR=str(beside / "stderr"),
            FAULT_COUNT=str(count),
            FAULT_BYTES=str(LEAST_BYTES),
            TMPDIR=str(folder / "tmp"),
            XDG_CACHE_HOME=str(folder / "cache"),
            MPLCONFIGDIR=str(self.home / "matplotlib"),
            OMP_NUM_THREADS="1",
            OPENBLAS_NUM_THREADS="1",
        )
        with (beside / "stdout").open("w+b") as out, (beside / "stderr").open("w+b") as err:
            line = [*(CLOSING if kind == "closed" else []), *command.program, *command.line]
            process = subprocess.Popen(line, cwd=folder, env=env, stdout=out, stderr=err, start_new_session=True)
            try:
                code = process.wait(LONGEST_S)
            except subprocess.TimeoutExpired:
                code = -signal.SIGALRM
            finally:
                _end_session(process)
        calls = struct.unpack("q", count.read_bytes())[0]
        texts = [(beside / name).read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr")]
        return Run(command, code, *texts, calls, folder, before, there, stale)


def _end_session(process: subprocess.Popen[bytes]) -> None:
    """Kills a command and what it left running, such as the encoder of a film, and waits until nothing of it writes."""
    end = time.monotonic() + ENDING_S
    with suppress(ProcessLookupError):
        while time.monotonic() < end:
            os.killpg(process.pid, signal.SIGKILL)
            process.poll()
            time.sleep(0.005)
    process.wait()


def _own_files(folder: Path) -> dict[str, Path]:
    found = _files(folder).items()
    return {
        name: path
        for name, path in found
        if (name.split("/")[0] not in HELPERS or name.startswith(OWN_CACHE)) and TEMPORARY not in name
    }


def _temporary(folder: Path) -> list[str]:
    return [name for name in _files(folder) if TEMPORARY in name]


def _files(folder: Path) -> dict[str, Path]:
    return {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*")) if path.is_file()}
