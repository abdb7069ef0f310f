"""Import of rerun, and the start and end of a recording. No other module imports rerun."""

from __future__ import annotations

import contextlib
import importlib
import os
import re
import sys
import threading
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

from mmp_env.errors import MmpError
from mmp_env.files.writing import check_writable, whole_file
from mmp_env.opengl import has_display

SPAWN = "spawn"
"""Name of the viewer as a target, instead of a file."""
SUFFIX = ".rrd"
_CHUNK_BYTES = 2**16


def require() -> Any:
    """Returns the module `rerun`. Raises `MmpError` if it is not installed."""
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise MmpError(
            f"recordings need rerun-sdk, which cannot be imported ({error}); get it with: pip install 'mmp-env[rerun]'"
        ) from error


def check(to: str | PathLike[str]) -> None:
    """Raises `MmpError` if no recording can be made.

    This is so if rerun is missing, if there is no display for `spawn`, or if `to` is not a writable `*.rrd`.
    """
    require()
    if to == SPAWN:
        if not has_display():
            raise MmpError(f"'{SPAWN}' opens a window, and there is no display here; record to a file {SUFFIX} instead")
        return
    path = Path(to)
    if path.suffix != SUFFIX:
        raise MmpError(f"'{path}' is no name for a recording; it must end in {SUFFIX}, or be '{SPAWN}' for the viewer")
    check_writable(to)


@contextlib.contextmanager
def recording_target(to: str | PathLike[str]) -> Iterator[str | PathLike[str]]:
    """Yields where to record to: `spawn` itself, or a temporary file that becomes `to` at the end."""
    if to == SPAWN:
        yield to
        return
    with whole_file(to) as temporary:
        yield temporary


class Recording:
    """A stream of one recording into the file `to`, or into a viewer that is opened for `spawn`.

    `kind` says what the recording holds: the viewer keeps a user's layout for the next recording of the same kind. The
    caller has passed `to` to `check`.
    """

    def __init__(self, to: str | PathLike[str], kind: str, name: str) -> None:
        rerun = require()
        self._file: _Pipe | None = None
        # Rerun replaces other characters by codes.
        self.stream = rerun.RecordingStream("mmp-env-" + re.sub(r"[^\w-]+", "-", kind, flags=re.ASCII).strip("-"))
        if to == SPAWN:
            rerun.spawn(recording=self.stream, hide_welcome_screen=True, executable_path=_viewer())
        else:
            self._file = _Pipe(Path(to))
            self.stream.save(self._file.entrance)
        self.stream.send_recording_name(name)
        # The time at which a row was written, and its number, would be two more timelines.
        rerun.set_log_time_enabled(False, recording=self.stream)
        rerun.set_log_tick_enabled(False, recording=self.stream)

    def end(self, blueprint: Any) -> None:
        """Sends the layout of the viewer and closes the file.

        Raises `MmpError` if the viewer was closed, and `OSError` if the file cannot be written.
        """
        self.stream.send_blueprint(blueprint)
        try:
            self.stream.flush()
        except RuntimeError as error:
            raise MmpError(f"the recording is incomplete: {error}") from error
        finally:
            self.stream.disconnect()
            if self._file is not None:
                self._file.close()


class _Pipe:
    """Copies the bytes written to `entrance` to a file. Rerun itself waits for ever if it cannot write to its file."""

    def __init__(self, path: Path) -> None:
        self._room = memoryview(bytearray(_CHUNK_BYTES))  # before the thread, which must not end for lack of memory
        self._sink = path.open("wb", buffering=0)
        self._source, self._end = os.pipe()
        self.entrance = Path(f"/proc/self/fd/{self._end}")
        self._error: OSError | None = None
        self._copying = threading.Thread(target=self._copy, daemon=True)
        self._copying.start()

    def close(self) -> None:
        """Waits until everything is copied. Raises `OSError` if it could not be written."""
        os.close(self._end)
        self._copying.join()
        os.close(self._source)
        self._sink.close()
        if self._error is not None:
            raise self._error

    def _copy(self) -> None:
        while count := os.readv(self._source, [self._room]):
            chunk = self._room[:count]
            while chunk and self._error is None:
                try:
                    chunk = chunk[self._sink.write(chunk) :]
                except OSError as error:
                    self._error = error


def entity_part(name: str) -> str:
    """Returns a name as a part of an entity's path: spaces and other characters that rerun takes amiss are escaped."""
    return require().escape_entity_path_part(name)


def _viewer() -> str | None:
    """Returns the viewer beside this interpreter; it is not on PATH if the virtual environment is not activated."""
    beside = Path(sys.executable).parent / "rerun"
    return str(beside) if beside.exists() else None
