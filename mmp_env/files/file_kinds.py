"""Kinds of files, recognised by their content, for messages about a file of the wrong kind."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from mmp_env import argument_checks
from mmp_env.errors import MmpError
from mmp_env.files.paths import is_file
from mmp_env.files.reading import NotJsonError, read_document
from mmp_env.files.regular_files import TooLargeError

INSTANCES, PLAN, EPISODE, CELL = "an instance file", "a plan", "an episode", "a cell file"
JOBS, SCHEDULE = "a file of jobs", "a schedule"
_TRAJECTORY = "a ROS 2 trajectory"
_RESULT_FIELD, _TRAJECTORY_FIELD = "planning_time_s", "joint_names"
_BY_FIELD = {
    "trajectories": SCHEDULE,
    "jobs": JOBS,
    "instances": INSTANCES,
    "positions": PLAN,
    "plans": EPISODE,
    "arms": CELL,
    _RESULT_FIELD: "a file of results",
    _TRAJECTORY_FIELD: _TRAJECTORY,
}
"""Field -> the kind of file that has it, the first that fits."""


def read_as(path: str | PathLike[str], kinds: tuple[str, ...], takes: str) -> Any:
    """Returns the content of a file, see `read_document`.

    Args:
        kinds: the kinds of file that are allowed.
        takes: words for messages on the kinds that are allowed.

    Raises:
        MmpError: for a file of another kind. A file of unknown kind is left to the reader.
    """
    try:
        data = read_document(path)
    except NotJsonError:
        suffix = Path(path).suffix.lower()
        if suffix in (".xml", ".mjcf", ".urdf"):
            raise MmpError(f"{path} is a MuJoCo model, which mmp plan takes; {takes}") from None
        if suffix != ".jsonl":
            raise
        data = {_RESULT_FIELD: None}  # lines of JSON, which together are not JSON
    except TooLargeError as error:
        if f"\n{_TRAJECTORY_FIELD}:".encode() not in b"\n" + error.beginning:
            raise
        data = {_TRAJECTORY_FIELD: None}
    kind = _kind(data)
    if kind is not None and kind not in kinds:
        raise MmpError(f"{path} is {kind}; {takes}")
    return data


def check_replaceable(path: str | PathLike[str], option: str) -> None:
    """Raises `MmpError` if `path`, the value of `option`, is an input file of this program."""
    if not is_file(path):
        return
    try:
        kind = _kind(read_document(path))
    except MmpError:  # no reader takes it
        return
    if kind in (INSTANCES, PLAN, EPISODE, CELL, JOBS, SCHEDULE):
        raise MmpError(f"{option} would overwrite {path}, which is {kind}; give another name, or remove it first")


def read_for(loader: str, path: str | PathLike[str], *kinds: str) -> Any:
    """Returns the content of a file, see `read_as`, for a function that reads these `kinds`."""
    argument_checks.path("path", path)
    return read_as(path, kinds, f"{loader} takes {' or '.join(kinds)}")


def _kind(data: Any) -> str | None:
    return next((kind for field, kind in _BY_FIELD.items() if isinstance(data, dict) and field in data), None)
