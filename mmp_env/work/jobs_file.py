"""Files of jobs, schema `mmp-jobs/1` (docs/reference/files.md)."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import msgspec

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.cell_file import cell_from_dict, name_or_stem
from mmp_env.files.cell_source import find_cell
from mmp_env.files.file_kinds import JOBS, read_for
from mmp_env.files.reading import Location, decode, decode_file, named, names_file
from mmp_env.model.cell import Cell
from mmp_env.model.goals import as_goal
from mmp_env.wording import shown
from mmp_env.work.jobs import Job, Jobs, Line, Move, Step, Wait
from mmp_env.work.object_steps import Grasp, Release
from mmp_env.work.objects_file import objects_from_data

JOBS_SCHEMA = "mmp-jobs/1"
STEPS = ("move", "line", "grasp", "release", "wait")
"""Kinds of steps."""
_KINDS = {"line": Line, "grasp": Grasp, "release": Release, "wait": Wait}


class JobData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    name: str
    steps: list[dict[str, Any]]
    arm: str | None = None
    after: list[str] = []


class JobsData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    cell: str | dict[str, Any]
    jobs: list[JobData]
    name: str | None = None
    start: dict[str, Any] = {}
    objects: list[dict[str, Any]] = []


def load_jobs(path: str | PathLike[str]) -> Jobs:
    """Reads a file of jobs, schema `mmp-jobs/1`. docs/reference/files.md describes the fields.

    Args:
        path: a JSON or YAML file.

    Raises:
        MmpError: for a file that cannot be read, or a fault in it, with file, field and value.
    """
    return jobs_from_dict(read_for("load_jobs", path, JOBS), str(path), folder=Path(path).parent, name=Path(path).stem)


def jobs_from_dict(data: Any, where: str | Location, *, folder: Path = Path(), name: str = "jobs") -> Jobs:
    """Returns the jobs in a file's `data`.

    Args:
        where: begin of the messages, such as the name of the file.
        folder: folder that the path of a cell file begins at.
        name: name of the work if the data has none.

    Raises:
        MmpError: for a fault, with field and value.
    """
    place, decoded = decode_file(data, JOBS_SCHEMA, JobsData, where)
    name = name_or_stem(decoded.name, name, place / "name")
    cell = _cell(decoded.cell, place / "cell", folder, name)
    start = {arm: as_goal(given, str(place / "start" / arm)) for arm, given in decoded.start.items()}
    jobs = tuple(_job(item, place / "jobs" / k) for k, item in enumerate(decoded.jobs))
    objects = objects_from_data(decoded.objects, place / "objects")
    with named(place):
        return Jobs(name=name, cell=cell, jobs=jobs, start=start, objects=objects)


def job_from_data(data: Any, place: Location) -> Job:
    """Returns the job in the form of JSON. Raises `MmpError`."""
    return _job(decode(data, JobData, place), place)


def _cell(data: str | dict[str, Any], place: Location, folder: Path, name: str) -> Cell:
    if isinstance(data, dict):
        return cell_from_dict(data, place, name=name)
    with named(place):
        return find_cell(folder / data if names_file(data) else data)


def _job(data: JobData, place: Location) -> Job:
    steps = tuple(_step(step, place / "steps" / k) for k, step in enumerate(data.steps))
    with named(place):
        return Job(name=data.name, steps=steps, arm=data.arm, after=tuple(data.after))


def _step(data: dict[str, Any], place: Location) -> Step:
    if len(data) != 1:
        raise place.wrong(data, f"an object with one of {', '.join(STEPS)}")
    [(kind, value)] = data.items()
    if kind not in STEPS:
        raise MmpError(f"{place}: {UnknownNameError('kind of step', shown(kind)[1:-1], STEPS)}")
    if kind == "move":
        return Move(as_goal(value, str(place / "move")))
    if kind in ("grasp", "release") and not isinstance(value, str):
        raise (place / kind).wrong(value, "the name of an object")
    with named(place):
        return _KINDS[kind](value)
