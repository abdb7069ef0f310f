"""Reads whole MuJoCo models from MJCF and URDF files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_file, real_path, refusal
from mmp_env.importing.source import one_line
from mmp_env.mujoco_import import mujoco, without_log, without_report

SUFFIXES = (".xml", ".mjcf", ".urdf")
"""Suffixes of files that hold a model."""


def is_model_file(path: str | Path) -> bool:
    """Returns whether a file is a model, by its suffix."""
    return Path(path).suffix.lower() in SUFFIXES


def load_model(path: str | Path) -> Any:
    """Returns the compiled `mujoco.MjModel` of a file; meshes are looked for relative to it. Raises `MmpError`."""
    if not is_file(path):
        what = "it is not a file" if exists(path) else "there is no such file"
        raise MmpError(f"{path} cannot be read: {what}")
    try:
        real_path(Path(path)).read_bytes().decode()
    except OSError as error:
        raise refusal(Path(path), "read", error) from None
    except UnicodeDecodeError as error:
        raise MmpError(f"{path} is not UTF-8 text: byte {error.start + 1} begins no character") from None
    try:
        with without_log(), without_report(beside_threads=True):
            return mujoco.MjModel.from_xml_path(str(real_path(Path(path))))
    except ValueError as error:
        raise MmpError(f"{path} cannot be read by MuJoCo: {one_line(error)}") from None
