"""Tasks by name: the entry points of the group `mmp_env.tasks`, of this and other distributions, loaded lazily."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.plugins import TASKS
from mmp_tasks.task import Task

_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}


@dataclass(frozen=True, kw_only=True)
class TaskDescription:
    """A task as `mmp list` shows it: the first line of its docstring, and its options with their defaults."""

    name: str
    summary: str
    options: dict[str, Any]


def names() -> list[str]:
    """Names of all registered tasks, sorted."""
    return TASKS.names()


def make(name: str, **options: Any) -> Task:
    """The task of that name with these options.

    Raises `UnknownNameError` for an unknown task or option, and `MmpError` for a task that cannot be loaded or a value
    that it refuses.
    """
    kind = TASKS.load(name)
    known = _fields(kind)
    for option, value in options.items():
        if option not in known:
            raise UnknownNameError(f"option of task '{name}'", option, known)
        _check_kind(name, option, value, known[option].default)
    task = kind(**options)
    if not isinstance(task, Task):
        raise MmpError(f"task '{name}' has no method sample(cell, rng)")
    return task


def describe(name: str) -> TaskDescription:
    """What the task is and which options it has. Raises like `make`."""
    kind = TASKS.load(name)
    summary = (kind.__doc__ or "").strip().partition("\n")[0]
    defaults = {
        option: field.default if field.default is not dataclasses.MISSING else None
        for option, field in _fields(kind).items()
    }
    return TaskDescription(name=name, summary=summary, options=defaults)


def _check_kind(name: str, option: str, value: object, default: object) -> None:
    """An option takes what its default is; a whole number will do for a number."""
    kind = type(default)
    if kind in _KINDS and type(value) is not kind and not (kind is float and type(value) is int):
        raise MmpError(f"{option} of task '{name}' is {value!r}; it must be {_KINDS[kind]}")


def _fields(kind: Any) -> dict[str, dataclasses.Field[Any]]:
    return {field.name: field for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else {}
